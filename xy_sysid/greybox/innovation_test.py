"""The part of the innovations that an effect would explain, to first order: a score test, like ``score_test`` for free simulation.

The filter is run with a small amount of each trace; the change of the innovations is what the effect would explain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import Companions, FilterFit
from xy_sysid.effects._scene import Guess
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.one_step import as_companions, companions
from xy_sysid.greybox.score_test import Projected, Trace, best_trace
from xy_sysid.greybox.start_rigid import mean_velocity_filter
from xy_sysid.samples.block import FloatArray

SMALL = 0.02  # size of the added trace, relative to the rms voltage or velocity


def traces(data: AxisData, model: AxisModel, effect: Effect, found: FilterFit, effects: Iterable[Effect]) -> list[Trace]:
    """The part of the innovations' power that each additional effect would explain, to first order, best first, with start values."""
    assert effect.one_step is not None
    library, fs, n = model.library, data.sampling_rate, data.first
    names = [name for name, _ in companions(model, effect)[1]]
    pairs = (
        zip(names, np.split(np.array(found.companions[0]), np.cumsum([len(library[name].names) for name in names])[:-1]), strict=True)
        if names
        else ()
    )
    own = as_companions(data, library, [(name, tuple(values)) for name, values in pairs])
    numbers = np.array([*found.base, *found.companions[0]])
    voltage, position, against, through = own.undo(numbers, n)
    still = np.zeros(0)

    def seen(by: Companions, what: FilterFit = found) -> FloatArray:
        assert effect.one_step is not None
        return effect.one_step.innovation(fs, what, by, n)

    def recording(u: FloatArray, y: FloatArray, f: FloatArray) -> Companions:
        return Companions(
            start=still,
            low=still,
            high=still,
            unit=still,
            positive=still.astype(np.bool_),
            undo=lambda _, samples: (u[:samples], y[: samples + 1], f[:samples], through),
            similar=own.similar,
            swing=own.swing,
        )

    here = seen(recording(voltage, position, against))
    skip = min(int(0.5 * fs), n // 4)
    error = _missing_velocity(data, found, here)
    scene = Scene(
        sampling_rate=fs,
        gain=found.base[0],
        pole=found.base[2],
        voltage=_late(voltage, found.base[1] * fs),
        velocity=data.velocity[:n],
        position=0.5 * (position[1:] + position[:-1]),
        error=error,
    )

    def change(item: Effect, column: FloatArray) -> FloatArray:
        size = SMALL * float(np.std(data.velocity if item.is_behind else voltage)) / (float(np.std(column)) + abs(float(np.mean(column))) + 1e-300)
        put = size * column
        other = recording(voltage, position - np.concatenate(([0.0], np.cumsum(put))) / fs, against) if item.is_behind else None
        both = against.copy()
        both[int(item.on_table)] += put
        return (seen(other or recording(voltage, position, both)) - here)[skip:] / size

    nuisance = np.stack(
        [(seen(recording(*own.undo(moved, n)[:3]), replace(found, base=tuple(moved[:3]))) - here)[skip:] for moved in _moved(numbers)]
    )
    space = Projected.of(here[skip:], nuisance)

    def acting(item: Effect) -> Callable[[Guess], FloatArray]:
        return lambda guess: -np.stack([change(item, column[:n]) for column in guess.columns])

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
