"""Start values of base and effect together, from the measured motion by linear least squares, without local minima.

The voltage is explained by acceleration, velocity and the effect's traces on the measured motion (inverse dynamic
identification; Gautier & Khalil 1990, eq. 8), all with the same low-pass. This
distinguishes friction from the drag of the base. At rest friction balances any drive, so a law of friction is determined from the samples
in motion alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.effects import Effect, Scene
from xy_sysid.samples.block import FloatArray

CUTOFFS = (10.0, 40.0)  # Hz: slow machines move below the first, quick ones up to the second
REST = 0.2  # fraction of the velocity's standard deviation below which friction may hold the axis
HIGHEST_CUTOFF = 0.2  # of the sampling rate
ENDS = 50  # a fiftieth of the samples at each end is left out, because a transform takes them for neighbours
FEW = 0.05  # least fraction of samples in motion; otherwise all samples are used


def cutoffs(sampling_rate: float) -> list[float]:
    """Hz, of the low-passes for this sampling rate."""
    return sorted({min(cutoff, HIGHEST_CUTOFF * sampling_rate) for cutoff in CUTOFFS})


@dataclass(frozen=True, slots=True)
class InverseStart:
    """gain: m/s/V; pole: rad/s; values: of the effect's parameters; sizes: factor on each force of the model."""

    gain: float
    pole: float
    values: tuple[float, ...]
    sizes: tuple[float, ...]


def inverse_starts(
    effect: Effect, scene: Scene, samples: int, forces: Sequence[FloatArray] = (), with_friction: bool = False, least: float = 0.0
) -> list[InverseStart]:
    """At most one start for each low-pass, from the first ``samples``.

    forces: (n,) V each, of the model's own effects, whose sizes are free; with_friction: True if dry friction is among them
    least: fraction of the residual voltage that the effect must explain
    """
    if effect.guesses is None or effect.is_behind:
        return []
    guesses = effect.guessed(scene)
    if not guesses:
        return []
    seen_forces = [scipy.fft.rfft(force[:samples]) for force in forces]
    seen_columns = [scipy.fft.rfft(guess.columns[:, :samples], axis=1) for guess in guesses]
    found = []
    for cutoff in cutoffs(scene.sampling_rate):
        slow, acceleration, velocity, voltage = _motion(scene, samples, cutoff)
        rows = slow.inside()
        if effect.is_dry or with_friction:
            moving = scipy.ndimage.minimum_filter1d(np.abs(velocity), 2 * int(0.5 * slow.rate / cutoff) + 1) > REST * float(np.std(velocity))
            rows = rows & moving if float(np.mean(moving)) > FEW else rows
        others = [slow(force) for force in seen_forces]
        known = np.array([acceleration, velocity, *others])[:, rows]
        best, kept = (1.0 - least) * _least(known, voltage[rows])[1] / (float(voltage[rows] @ voltage[rows]) + 1e-300), None
        for guess, columns in zip(guesses, seen_columns, strict=True):
            acting = slow(columns)
            target = voltage - acting[0] if guess.whole else voltage
            free = acting[:0] if guess.whole else acting
            coefficients, residual = _least(np.concatenate((known, free[:, rows])), target[rows])
            residual /= float(target[rows] @ target[rows]) + 1e-300
            if residual < best and coefficients[0] * coefficients[1] > 0.0:
                inertia, drag, *sizes = (float(value) for value in coefficients[: 2 + len(others)])
                part = 1.0 / (drag * scene.gain) if effect.is_of_the_drag else 1.0  # its columns are in volts of the base's drag
                own = np.ones(len(acting)) if guess.whole else coefficients[2 + len(others) :] * part
                best, kept = residual, InverseStart(1.0 / drag, drag / inertia, effect.read(guess, own, scene.similar), tuple(sizes))
        if kept is not None:
            found.append(kept)
    return found


def rigid_starts(scene: Scene) -> list[tuple[float, float]]:
    """(gain, pole) of a rigid axis by inverse dynamics, from each low-pass: alone, with a load, and with a load and Coulomb friction."""
    samples, found = scene.velocity.size, []
    direction, ones = scipy.fft.rfft(scene.direction()), scipy.fft.rfft(np.ones(samples))
    for cutoff in cutoffs(scene.sampling_rate):
        slow, acceleration, velocity, voltage = _motion(scene, samples, cutoff)
        rows = slow.inside()
        moving = scipy.ndimage.minimum_filter1d(np.abs(velocity), 2 * int(0.5 * slow.rate / cutoff) + 1) > REST * float(np.std(velocity))
        rows = rows & moving if float(np.mean(moving)) > FEW else rows
        known = [acceleration, velocity, slow(ones), slow(direction)]
        for count in (2, 3, 4):
            inertia, drag = _least(np.array(known[:count])[:, rows], voltage[rows])[0][:2].tolist()
            if inertia * drag > 0.0:
                found.append((1.0 / drag, drag / inertia))
    return found


@lru_cache(maxsize=4)
def _motion(scene: Scene, samples: int, cutoff: float) -> tuple[LowPass, FloatArray, FloatArray, FloatArray]:
    """The low-pass, and filtered acceleration, velocity and voltage: the same for all effects."""
    slow = LowPass.of(samples, scene.sampling_rate, cutoff)
    velocity, voltage = (scipy.fft.rfft(signal[:samples]) for signal in (scene.velocity, scene.voltage))
    return slow, slow(velocity, derived=True), slow(velocity), slow(voltage)


@dataclass(frozen=True, slots=True)
class LowPass:
    """Low-pass with a reduced sampling rate: a Butterworth filter forward and backward, without phase shift.

    lines: weight of each kept line of the spectrum; turn: rad/s of each; size: number of output samples; rate: their sampling rate, Hz
    """

    lines: FloatArray
    turn: FloatArray
    samples: int
    size: int
    rate: float

    @staticmethod
    def of(samples: int, sampling_rate: float, cutoff: float) -> LowPass:
        """A low-pass for the first ``samples`` of signals."""
        kept = min(int(3.0 * cutoff / sampling_rate * samples) + 1, samples // 2)
        frequency = np.arange(kept + 1) * sampling_rate / samples
        lines = 1.0 / (1.0 + (frequency / cutoff) ** 4)
        return LowPass(lines=lines, turn=2.0 * np.pi * frequency, samples=samples, size=2 * kept, rate=2 * kept * sampling_rate / samples)

    def __call__(self, seen: NDArray[np.complex128], derived: bool = False) -> FloatArray:
        """(..., size) of signals whose spectra (..., lines) are ``rfft`` of the samples, or of their derivatives by time."""
        kept = seen[..., : self.lines.size] * self.lines
        return np.asarray(scipy.fft.irfft(kept * (1j * self.turn if derived else 1.0), self.size) * (self.size / self.samples))

    def inside(self) -> NDArray[np.bool_]:
        """(size,) False near the ends."""
        rows = np.ones(self.size, dtype=np.bool_)
        ends = max(self.size // ENDS, 1)
        rows[:ends] = rows[-ends:] = False
        return rows


def _least(rows: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Coefficients (k,) of rows (k, n) that explain the target (n,) best, and the residual sum of squares."""
    size = np.linalg.norm(rows, axis=1) + 1e-300
    unit = rows / size[:, None]
    coefficients = np.linalg.lstsq(unit @ unit.T, unit @ target, rcond=1e-12)[0]
    residual = target - coefficients @ unit
    return np.asarray(coefficients / size), float(residual @ residual)
