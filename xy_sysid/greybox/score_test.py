"""The part of the error of a model that an effect would explain, to first order: a score test, with start values for the fit.

An effect's trace is its force on the measured motion, passed through the base (Rao 1948, score test); the part that a change of
the model's own parameters would explain is projected out first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy

from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._scene import Guess
from xy_sysid.effects._similarity import Similarity
from xy_sysid.greybox.floor import Floor, Windows
from xy_sysid.greybox.objective import Objective
from xy_sysid.greybox.start_rigid import mean_velocity_filter
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Trace:
    """share: fraction (0..1) of the whitened error's power that the effect's best trace explains; values: start values of its parameters."""

    effect: str
    share: float
    values: tuple[float, ...]


@dataclass(frozen=True)
class Screen:
    """The score test of several effects on one error, alone or together.

    traces: largest share first; rows: for each effect, the indices of the columns of its best trace in what follows
    inner: (bands, k, k) products of all columns in each band; seen: (bands, k) of the columns with the error; error: (bands,) of the error with
    itself, whitened; power: (bands,) of the error
    """

    traces: tuple[Trace, ...]
    rows: Mapping[str, tuple[int, ...]]
    inner: FloatArray
    seen: FloatArray
    error: FloatArray
    power: FloatArray
    objective: Objective

    @cached_property
    def score(self) -> float:
        """Score of the error, nats a line."""
        return self.objective.of_power(self.power)

    def gain(self, names: Iterable[str]) -> float:
        """Nats a line by which effects lower the score to first order, each with its best trace; no simulation."""
        rows = np.array([row for name in names for row in self.rows[name]], dtype=np.int64)
        inner, seen = self.inner[:, rows[:, None], rows], self.seen[:, rows]
        coefficients = np.linalg.lstsq(inner.sum(axis=0), seen.sum(axis=0), rcond=1e-8)[0]
        left = self.error - 2.0 * seen @ coefficients + np.einsum("bij,i,j->b", inner, coefficients, coefficients)
        # 0 in bands without excitation: the response there is unknown
        ratio = np.where(self.error > 0.0, np.maximum(left, 0.0) / np.maximum(self.error, 1e-300), 1.0)
        return self.score - self.objective.of_power(self.power * np.minimum(ratio, 1.0))


@dataclass(frozen=True, slots=True)
class Projected:
    """An error, as independent numbers (m,), without the part that changes of the model's own parameters explain.

    basis: (m, k) orthonormal basis of these changes; power: of the remaining error
    """

    error: FloatArray
    basis: FloatArray
    power: float

    @staticmethod
    def of(error: FloatArray, nuisance: FloatArray) -> Projected:
        """error: (m,); nuisance: (k, m) its change by each parameter."""
        basis = np.linalg.qr(nuisance.T)[0]
        left = np.asarray(error - basis @ (basis.T @ error))
        return Projected(left, basis, float(left @ left) + 1e-300)

    def share(self, columns: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Fraction of the error's power that columns (k, m) explain, their coefficients, and the projected columns, normalised."""
        clean = columns - (columns @ self.basis) @ self.basis.T
        size = np.linalg.norm(clean, axis=1) + 1e-300
        clean /= size[:, None]
        seen = clean @ self.error
        coefficients = np.linalg.lstsq(clean @ clean.T, seen, rcond=1e-10)[0]
        return float(seen @ coefficients) / self.power, np.asarray(coefficients / size), clean


def best_trace(
    effect: Effect, scene: Scene, space: Projected, guesses: Iterable[Guess], acting: Callable[[Guess], FloatArray]
) -> tuple[Trace, FloatArray | None]:
    """The guess of an effect that explains most, and its projected columns; None if no guess explains anything.

    acting: change of the error by the columns of a guess, (k, m)
    """
    best, chosen = Trace(effect.name, 0.0, tuple(item.typical for item in effect.on(scene.similar))), None
    for guess in guesses:
        share, coefficients, columns = space.share(acting(guess))
        if share > best.share:
            mean = coefficients.reshape(-1, len(guess.columns)).mean(axis=0)  # over the recordings
            best, chosen = Trace(effect.name, share, effect.read(guess, mean, scene.similar)), columns
    return best, chosen


def screen(effects: Iterable[Effect], scene: Scene, nuisance: FloatArray, windows: Windows, least: Floor) -> Screen:
    """The best trace of each effect.

    nuisance: (k, n) change of the model's velocity per unit of each of its parameters; windows: of the scene
    """
    objective, left = Objective.of(least), windows.layout.power(windows.spectrum(scene.error))
    weight = ((objective.lines > 0.0) / np.sqrt(objective.spectrum(left)))[windows.layout.band]

    def white(signals: FloatArray) -> FloatArray:
        """(k, n) -> (k, m)"""
        values = windows.spectrum(signals) * weight
        return np.concatenate((values.real, values.imag), axis=-1).reshape(len(signals), -1)

    space = Projected.of(white(scene.error[None, :])[0], white(nuisance))
    found, rows, columns = [], {}, [space.error[None, :]]
    for effect in effects:

        def acting(guess: Guess, effect: Effect = effect) -> FloatArray:
            force = _of_each_recording(guess.columns, effect, scene)
            return white(force if effect.is_behind else _through_base(force, scene))

        best, chosen = best_trace(effect, scene, space, (guess for guess in effect.guessed(scene) if not guess.inverse_only), acting)
        found.append(best)
        if chosen is not None:
            begin = sum(map(len, columns))
            rows[effect.name] = tuple(range(begin, begin + len(chosen)))
            columns.append(chosen)
    inner = _by_band(np.concatenate(columns), windows)
    return Screen(
        traces=tuple(sorted(found, key=lambda trace: -trace.share)),
        rows=rows,
        inner=inner,
        seen=inner[:, :, 0],
        error=inner[:, 0, 0],
        power=left,
        objective=objective,
    )


def _of_each_recording(columns: FloatArray, effect: Effect, scene: Scene) -> FloatArray:
    """(k, n) columns of a trace; (k r, n) for an effect with a separate parameter in each of r recordings."""
    if len(scene.recordings) < 2 or not any(item.per_recording for item in effect.parameters):
        return columns
    edges = np.cumsum([0, *scene.recordings])
    number = np.arange(scene.voltage.size)
    return np.concatenate([columns * ((number >= low) & (number < high)) for low, high in pairwise(edges)])


def _by_band(rows: FloatArray, windows: Windows) -> FloatArray:
    """(bands, k, k) products of rows (k, m) with each other in each band; m: windows, real and imaginary part, lines."""
    layout = windows.layout
    each = rows.reshape(len(rows), windows.begins.size * 2, layout.band.size)
    begins = np.append(np.searchsorted(layout.band, np.arange(layout.count)), layout.band.size)
    parts = (each[:, :, first:last].reshape(len(rows), -1) for first, last in pairwise(begins))
    return np.stack([part @ part.T for part in parts])


def bounded(effect: Effect, values: Iterable[float], similar: Similarity) -> tuple[float, ...]:
    """The values, clipped to the bounds of the effect's parameters on this machine."""
    return tuple(float(min(max(value, item.low), item.high)) for value, item in zip(values, effect.on(similar), strict=True))


def _through_base(forces: FloatArray, scene: Scene) -> FloatArray:
    """(k, n) V against the drive -> m/s, behind the base and the sections of the motion."""
    b, a = mean_velocity_filter(scene.gain, scene.pole, scene.sampling_rate)
    moved = -scipy.signal.lfilter(b, a, forces, axis=1)
    for b0, b1, b2, a1, a2 in scene.sections:
        moved = scipy.signal.lfilter((b0, b1, b2), (1.0, a1, a2), moved, axis=1)
    return np.asarray(moved)
