"""How much of a model's error an effect would explain, to first order: a score test, and start values for its fit.

An effect's trace is its force on the measured motion, passed through the base (Rao 1948, score test); what a change of
gain, delay or pole would do is projected out first.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.signal

from xy_sysid.base_start import mean_velocity_filter
from xy_sysid.effects import Effect, Guess, Scene
from xy_sysid.spectral_cost import Bands, Floor, tolerance
from xy_sysid.stream import FloatArray

MANY = 5  # traces of one effect; more are looked at on the first part of the data only


@dataclass(frozen=True, slots=True)
class Trace:
    """share: part (0..1) of the whitened error's power that the effect's best trace explains; values: start of its parameters."""

    effect: str
    share: float
    values: tuple[float, ...]


def screen(effects: Iterable[Effect], scene: Scene, nuisance: FloatArray, layout: Bands, least: Floor, short: int) -> list[Trace]:
    """The best trace of each effect, largest share first.

    nuisance: (k, n) change of the model's velocity per unit of each parameter that it has already;
    short: samples to which effects with many traces are confined.
    """
    power = tolerance(layout, layout.spectrum(scene.error), least)
    weight = (least.excited / np.sqrt(power))[layout.band]
    prepared = [_Prepared(scene.error[:n], nuisance[:, :n], layout, weight) for n in (scene.error.size, min(short, scene.error.size))]
    found = []
    for effect in effects:
        guesses = list(effect.guesses(scene)) if effect.guesses is not None else []
        space = prepared[1] if len(guesses) > MANY else prepared[0]
        best = Trace(effect.name, 0.0, effect.typical)
        for guess in guesses:
            share, coefficients = space.share(_through_base(guess, scene, space.samples))
            if share > best.share:
                best = Trace(effect.name, share, bounded(effect, guess.read(coefficients)))
        found.append(best)
    return sorted(found, key=lambda trace: -trace.share)


def bounded(effect: Effect, values: Iterable[float]) -> tuple[float, ...]:
    """The values, moved into the bounds of the effect's parameters."""
    return tuple(float(min(max(value, item.low), item.high)) for value, item in zip(values, effect.parameters, strict=True))


def _through_base(guess: Guess, scene: Scene, samples: int) -> FloatArray:
    columns = guess.columns[:, :samples]
    if guess.at_encoder:
        return columns
    b, a = mean_velocity_filter(scene.gain, scene.pole, scene.sampling_rate)
    return np.asarray(-scipy.signal.lfilter(b, a, columns, axis=1))


class _Prepared:
    """The error over the first samples, whitened, with the nuisance projected out."""

    def __init__(self, error: FloatArray, nuisance: FloatArray, layout: Bands, weight: FloatArray) -> None:
        self.samples, self.layout, self.weight = error.size, layout, weight
        self.basis = np.linalg.qr(np.stack([self._white(row) for row in nuisance], axis=1))[0]
        self.error = self._clean(self._white(error))
        self.power = float(self.error @ self.error) + 1e-300

    def _white(self, signal: FloatArray) -> FloatArray:
        values = self.layout.spectrum(signal) * self.weight
        return np.concatenate((values.real.ravel(), values.imag.ravel()))

    def _clean(self, values: FloatArray) -> FloatArray:
        return np.asarray(values - (values @ self.basis) @ self.basis.T)

    def share(self, columns: FloatArray) -> tuple[float, FloatArray]:
        """Part of the error's power explained, and the coefficients."""
        white = np.stack([self._clean(self._white(row)) for row in columns])
        size = np.linalg.norm(white, axis=1) + 1e-300
        white /= size[:, None]
        seen = white @ self.error
        coefficients = np.linalg.pinv(white @ white.T, rcond=1e-10, hermitian=True) @ seen
        return float(seen @ coefficients) / self.power, np.asarray(coefficients / size)
