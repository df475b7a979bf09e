"""Base and effect together from the measured motion by linear least squares: a start that has no wrong valley.

The voltage is explained by acceleration, velocity and the effect's traces on the measured motion (inverse dynamic
identification; Gautier & Khalil 1990, eq. 8), all seen through the same low-pass. Friction that the base alone takes for
drag is told apart here.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.effects import Effect, Scene
from xy_sysid.samples.block import FloatArray

CUTOFFS = (10.0, 40.0)  # Hz: slow machines move below the first, quick ones up to the second


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
        best, kept = np.inf, None
        for guess in guesses:
            rows = [acceleration, velocity, *(scene.smooth(column, cutoff)[:samples] for column in guess.columns)]
            coefficients, left = _least(np.array(rows), voltage)
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
