"""The parameters of an axis model as one row of numbers: their simulation, bounds and scales, and the fitted model with its intervals.

A parameter that may differ between recordings (a load) is in the row with its value for the first recording; the end of the row holds
the differences of each later recording. Start speeds are not parameters: they are computed again at the start of each fit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from xy_sysid.axis.model import AxisModel, simulator, start_of
from xy_sysid.effects import Parameter
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.least_squares import Predictor, Scale, Solution
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table

BEGINS = 2000.0  # Hz: sub-steps for the estimation of start speeds


def parameter_table(parameters: tuple[Estimate, ...]) -> Table:
    """Each parameter with its 95 % interval."""
    return Table(("parameter", "value", "from", "to", "unit"), tuple((item.name, item.value, item.low, item.high, item.unit) for item in parameters))


@dataclass(frozen=True, slots=True)
class FitProblem:
    """The parameters and simulation of a fit.

    early: True for data of the first stage only; at: sub-steps, Hz -> simulation of a row of parameters; row: values of the model; scale: theirs
    The row starts as that of ``simulator`` for the first recording; differences of later recordings follow.
    """

    early: bool
    at: Callable[[float], Predictor]
    row: FloatArray
    scale: Scale


def problem(data: AxisData, model: AxisModel, early: bool) -> FitProblem:
    """The model as a problem for a solver."""
    names, own = [name for name, _ in model.effects], _own(model)
    items = [item for name in names for item in model.library[name].on(data.similar)]
    places = np.array(own, dtype=np.int64)
    known = all(len(values) == len(data.runs) for _, values in model.per_recording)  # otherwise they belong to other recordings
    models = [model.in_recording(k) if known else model for k in range(len(data.runs))]
    each = np.array([one.row for one in models])
    spans = [slice(run.start, run.start + count + 1) for run, count in zip(data.runs, data.counts(early), strict=True)]
    signals = [(data.voltage[span], data.position[span]) for span in spans]
    first, later = each[0], each[1:, places] - each[0, places]
    size = first.size

    @cache
    def starts() -> list[float]:
        return [start_of(one, data.sampling_rate, *its, BEGINS) for one, its in zip(models, signals, strict=True)]

    def at(fine: float) -> Predictor:
        runs = [simulator(model.library, names, data.sampling_rate, *its, fine) for its in signals]
        speeds, cost = starts(), sum(data.counts(early)) * (max(fine / data.sampling_rate, 1.0) if names else 1.0)

        def simulated(values: FloatArray) -> FloatArray:
            rows = np.repeat(values[None, :size], len(runs), axis=0)
            rows[1:, places] += values[size:].reshape(later.shape)
            data.work.add(cost)
            parts = [one(row, speed) for one, row, speed in zip(runs, rows, speeds, strict=True)]
            return parts[0] if len(parts) == 1 else np.concatenate(parts)

        return simulated

    unit = [max(unit_of(item), abs(value)) for item, value in zip(items, first[3:].tolist(), strict=True)]
    unit_later = np.tile([unit[place - 3] for place in own], len(models) - 1)
    free = np.full(later.size, np.inf)
    scale = Scale(
        np.array([-np.inf, 0.0, 1e-2, *(item.low for item in items), *-free]),
        np.array([np.inf, max(data.longest_delay, model.delay), 1e5, *(item.high for item in items), *free]),
        np.array([False, False, True, *(item.positive for item in items), *np.zeros(free.size, dtype=np.bool_)]),
        np.array([abs(model.gain) or 1.0, 20.0 / data.sampling_rate, 1.0, *unit, *unit_later]),
    )
    return FitProblem(early, at, np.concatenate((first, later.ravel())), scale)


def model_of(data: AxisData, start: AxisModel, values: FloatArray) -> AxisModel:
    """The model of a row of ``problem``."""
    own, size, more = _own(start), start.row.size, len(data.runs) - 1
    later = values[size:].reshape(-1, len(own)) if own else np.zeros((more, 0))
    each = values[own] + np.vstack((np.zeros((1, len(own))), later))  # (recordings, own)
    row = values[:size].copy()
    row[own] = each.mean(axis=0)
    rest = iter(row[3:].tolist())
    effects = tuple((name, tuple(next(rest) for _ in old)) for name, old in start.effects)
    model = replace(start, gain=float(row[0]), delay=float(row[1]), pole=float(row[2]), effects=effects)
    names = list(model.values())
    known = tuple((names[place], tuple(each[:, k].tolist())) for k, place in enumerate(own)) if each.shape[0] > 1 else ()
    return replace(model, per_recording=known)


def estimates(data: AxisData, model: AxisModel, scale: Scale, found: Solution) -> tuple[Estimate, ...]:
    """Every parameter with its 95 % interval."""
    inner, spread = scale.inner(found.values), Z95 * np.sqrt(np.diag(found.covariance))
    wide = Scale(np.where(scale.positive, scale.low, -np.inf), np.full_like(scale.high, np.inf), scale.positive, scale.unit)
    low, high = wide.outer(inner - spread), np.where(np.isinf(spread), np.inf, wide.outer(inner + spread))
    high = np.where(scale.positive & np.isfinite(spread), np.minimum(high, np.maximum(scale.high, found.values)), high)  # no machine has more
    low[1] = max(low[1], 0.0)  # no delay is negative
    inner_units = ["m/s/V", "s", "rad/s", *(item.unit for name, _ in model.effects for item in model.library[name].parameters)]
    units = [data.units.of(unit) for unit in inner_units]
    every = [
        Estimate(name=name, value=value, unit=unit, low=float(min(a, b)), high=float(max(a, b)))
        for (name, value), unit, a, b in zip(model.values().items(), units, low, high, strict=False)
    ]
    own, each = _own(model), dict(model.per_recording)
    for column, place in enumerate(own if each else ()):
        later = len(every) + column + len(own) * np.arange(len(data.runs) - 1)
        rows = np.array([place, *later])
        spread = Z95 * scale.unit[place] * _spread_of_each(found.covariance[np.ix_(rows, rows)])
        item = every[place]
        *parts, mean = (
            replace(item, value=value, low=float(value - width), high=float(value + width))
            for value, width in zip((*each[item.name], item.value), spread, strict=True)
        )
        every[place] = replace(mean, recordings=tuple(parts))
    return tuple(every)


def _spread_of_each(covariance: FloatArray) -> FloatArray:
    """(r + 1,) standard deviation of a value in each of r recordings, and of their mean; covariance (r, r) of the first and of the differences."""
    count = covariance.shape[0]
    ways = np.eye(count)
    ways[:, 0] = 1.0
    ways = np.vstack((ways, ways.mean(axis=0)))
    power = np.einsum("ij,jk,ik->i", ways, covariance, ways)
    return np.asarray(np.sqrt(np.where(np.isnan(power), np.inf, np.maximum(power, 0.0))))  # nan: no influence on the data


def _own(model: AxisModel) -> list[int]:
    """Indices in a model's row of the parameters that may differ between recordings."""
    items = (item for name, _ in model.effects for item in model.library[name].parameters)
    return [3 + k for k, item in enumerate(items) if item.per_recording]


def unit_of(item: Parameter) -> float:
    """Size of 1 in a solver, for a parameter that is not fitted as a logarithm."""
    return abs(item.typical) or min(1.0, item.high - item.low)
