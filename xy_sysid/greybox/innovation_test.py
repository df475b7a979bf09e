"""The part of the innovations that an effect would explain, to first order: a score test, like ``score_test`` for free simulation.

The filter is run with a small amount of each trace; the change of the innovations is what the effect would explain.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import Companions, FilterFit, OneStep
from xy_sysid.effects._scene import Guess
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.one_step import SETTLING, as_companions, companions
from xy_sysid.greybox.score_test import Projected, Trace, best_trace
from xy_sysid.greybox.start_rigid import mean_velocity_filter
from xy_sysid.samples.block import FloatArray

SMALL = 0.02  # size of the added trace, relative to the rms voltage or velocity


@dataclass(frozen=True)
class _Filter:
    """The filter of a fit, to be run again on a changed recording.

    law: of the effect; own: its companions; numbers: base and companions of the fit; samples: of the first stage
    """

    law: OneStep
    found: FilterFit
    own: Companions
    numbers: FloatArray
    sampling_rate: float
    samples: int

    @classmethod
    def of(cls, data: AxisData, model: AxisModel, effect: Effect, found: FilterFit) -> _Filter:
        """The filter of an effect that one-step prediction fitted."""
        assert effect.one_step is not None
        names, values, fitted = [name for name, _ in companions(model, effect)[1]], iter(found.companions[0]), []
        for name in names:
            fitted.append((name, tuple(itertools.islice(values, len(model.library[name].names)))))
        own, numbers = as_companions(data, model.library, fitted), np.array([*found.base, *found.companions[0]])
        return cls(law=effect.one_step, found=found, own=own, numbers=numbers, sampling_rate=data.sampling_rate, samples=data.first)

    def undone(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Voltage, position and forces against the drive without the companions."""
        return self.own.undo(numbers, self.samples)[:3]

    def innovation(self, voltage: FloatArray, position: FloatArray, against: FloatArray, base: FloatArray | None = None) -> FloatArray:
        """(n,) innovations on this recording; base: gain, delay and pole, if not those of the fit."""
        still, through = np.zeros(0), self.own.undo(self.numbers, self.samples)[3]
        recording = Companions(
            start=still,
            low=still,
            high=still,
            unit=still,
            positive=still.astype(np.bool_),
            undo=lambda _, samples: (voltage[:samples], position[: samples + 1], against[:samples], through),
            similar=self.own.similar,
            swing=self.own.swing,
        )
        found = self.found if base is None else replace(self.found, base=tuple(base))
        return self.law.innovation(self.sampling_rate, found, recording, self.samples)


def traces(data: AxisData, model: AxisModel, effect: Effect, found: FilterFit, effects: Iterable[Effect]) -> list[Trace]:
    """The part of the innovations' power that each additional effect would explain, to first order, best first, with start values."""
    own, fs, n = _Filter.of(data, model, effect, found), data.sampling_rate, data.first
    voltage, position, against = own.undone(own.numbers)
    here = own.innovation(voltage, position, against)
    skip = min(int(SETTLING * fs), n // 4)
    scene = Scene(
        sampling_rate=fs,
        gain=found.base[0],
        pole=found.base[2],
        voltage=_late(voltage, found.base[1] * fs),
        velocity=data.velocity[:n],
        position=0.5 * (position[1:] + position[:-1]),
        error=_missing_velocity(data, found, here),
    )

    def change(item: Effect, column: FloatArray) -> FloatArray:
        size = SMALL * float(np.std(data.velocity if item.is_behind else voltage)) / (float(np.std(column)) + abs(float(np.mean(column))) + 1e-300)
        put, forces = size * column, against
        behind = np.concatenate(([0.0], np.cumsum(put))) / fs if item.is_behind else 0.0
        if not item.is_behind:
            forces = against.copy()
            forces[int(item.on_table)] += put
        return (own.innovation(voltage, position - behind, forces) - here)[skip:] / size

    def acting(item: Effect) -> Callable[[Guess], FloatArray]:
        return lambda guess: -np.stack([change(item, column[:n]) for column in guess.columns])

    nuisance = np.stack([(own.innovation(*own.undone(moved), moved[:3]) - here)[skip:] for moved in _moved(own.numbers)])
    space = Projected.of(here[skip:], nuisance)
    best = (best_trace(item, scene, space, item.guessed(scene), acting(item))[0] for item in effects)
    return sorted(best, key=lambda trace: -trace.share)


def _moved(numbers: FloatArray) -> list[FloatArray]:
    found = []
    for k in range(3):
        moved = numbers.copy()
        moved[k] *= 1.001
        found.append(moved)
    return found


def _missing_velocity(data: AxisData, found: FilterFit, innovation: FloatArray) -> FloatArray:
    """(n,) m/s: response of the base to the forces that the innovations imply. Correct except for its size and a short delay."""
    gain, _, pole = found.base
    b, a = mean_velocity_filter(gain, pole, data.sampling_rate)
    force = innovation * found.noise * data.sampling_rate**2 / (gain * pole)
    return np.asarray(scipy.signal.lfilter(b, a, force))


def _late(voltage: FloatArray, samples: float) -> FloatArray:
    whole = int(samples + 0.5)
    return np.concatenate((np.zeros(whole), voltage))[: voltage.size]
