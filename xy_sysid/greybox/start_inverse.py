"""Base and effect together from the measured motion by linear least squares: a start that has no wrong valley.

The voltage is explained by acceleration, velocity and the effect's traces on the measured motion (inverse dynamic
identification; Gautier & Khalil 1990, eq. 8), all seen through the same low-pass. Friction that the base alone takes for
drag is told apart here. At rest friction takes whatever the drive gives, so that a law of friction is read from the samples
in motion alone.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import minimum_filter1d

from xy_sysid.effects import Effect, Scene
from xy_sysid.samples.block import FloatArray

CUTOFFS = (10.0, 40.0)  # Hz: slow machines move below the first, quick ones up to the second
REST = 0.2  # part of the usual speed below which friction may be holding it
FEW = 0.05  # part of the samples that must be in motion, else all are used


def inverse_starts(effect: Effect, scene: Scene, samples: int) -> list[tuple[float, float, tuple[float, ...]]]:
    """(gain m/s/V, pole rad/s, values of the parameters), one for each low-pass at most, from the first samples."""
    if effect.guesses is None:
        return []
    guesses = [guess for guess in effect.guessed(scene) if not guess.at_encoder]
    found = []
    for cutoff in CUTOFFS:
        if cutoff > 0.2 * scene.sampling_rate or not guesses:
            continue
        velocity = scene.smooth(scene.velocity, cutoff)[:samples]
        acceleration = np.gradient(velocity) * scene.sampling_rate
        voltage = scene.smooth(scene.voltage, cutoff)[:samples]
        rows = np.ones_like(velocity, dtype=np.bool_)
        around = 2 * int(0.5 * scene.sampling_rate / cutoff) + 1
        if effect.is_dry:
            moving = minimum_filter1d(np.abs(velocity), around) > REST * float(np.std(velocity))
            rows = moving if float(np.mean(moving)) > FEW else rows
        best, kept = np.inf, None
        for guess in guesses:
            columns = [scene.smooth(column, cutoff)[:samples] for column in guess.columns]
            coefficients, left = _least(np.array([acceleration, velocity, *columns])[:, rows], voltage[rows])
            if left < best and coefficients[0] * coefficients[1] > 0.0:
                best, kept = left, (1.0 / float(coefficients[1]), float(coefficients[1] / coefficients[0]), guess.read(coefficients[2:]))
        if kept is not None:
            found.append(kept)
    return found


def _least(rows: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients (k,) of rows (k, n) that explain the target (n,) best, and the squares left."""
    size = np.linalg.norm(rows, axis=1) + 1e-300
    unit = rows / size[:, None]
    coefficients = np.linalg.pinv(unit @ unit.T, rcond=1e-12, hermitian=True) @ (unit @ target)
    left = target - coefficients @ unit
    return np.asarray(coefficients / size), float(left @ left)
