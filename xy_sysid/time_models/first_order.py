"""First order with delay and friction, from short step and ramp tests: tau v' + v = gain (u - friction sign(v) - load).

In the terms of robot builders (WPILib's feedforward): u = kS sign(v) + kV v + kA v', with kS the friction, kV = 1 / gain and
kA = tau / gain. Between samples the input is held and the solution is exact, including stops where the speed reaches zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.time_models.output_error import Minimized, Told, shortest, solved
from xy_sysid.units import Units

FEWEST = 12  # samples
MOST = 20_000  # samples of all recordings; later ones are not used
CONSTANTS, DELAYS = 14, 14  # size of the grid for start values
BEST = 3  # number of start values that are fitted
THINNED = 4000  # samples used for the grid, at most
LEVEL = 0.02  # fraction of the input's range that counts as another level
TURNED = 0.05  # fraction of the largest speed that counts as motion in the other direction
LONGEST = 0.5  # of the longest recording: a longer delay or time constant is not visible

Term = Literal["friction", "load", "offset"]


@dataclass(frozen=True, slots=True)
class FirstOrder:
    """The result of short tests of an axis.

    quantities:  gain, time constant, delay, then friction, load or offset (load and friction in one) if the data determine them; kV, kA, kS
    levels:      number of levels of the input; both_ways: True if it moves both ways; settled: duration of the longest level in time constants
    error:       rms of the residual error, in the speed's unit; explained: fraction of the speed's power about its mean
    repeats:     s for which the residual is correlated: more than a few samples is not noise; seconds: of the recordings that were used
    unused:      s of the recordings after those
    longest_delay: largest tested delay, s; an interval that reaches it determines nothing
    measured, simulated: (n,) speeds of all recordings
    """

    quantities: tuple[Told, ...]
    units: Units
    sampling_rate: float
    levels: int
    both_ways: bool
    settled: float
    error: float
    explained: float
    repeats: float
    longest_delay: float
    seconds: float
    unused: float
    terms: tuple[Term, ...]
    measured: FloatArray
    simulated: FloatArray

    def __getitem__(self, name: str) -> Told:
        """A quantity by its name; raises KeyError."""
        return {item.name: item for item in self.quantities}[name]


def first_order(runs: Sequence[Run]) -> FirstOrder:
    """Fit of one or several short tests of one axis. Raises BadInput for too few samples, or an input that never changes."""
    if not runs:
        raise BadInput("runs", "none", "one or more", "Give at least one.")
    rate, units = runs[0].sampling_rate, runs[0].units
    given, runs = sum(map(len, runs)), _shortened(runs)
    inputs, speeds = zip(*(_speed(run) for run in runs), strict=True)
    if sum(map(len, speeds)) < FEWEST:
        raise BadInput("number of samples", sum(map(len, speeds)), f"{FEWEST} or more", "Record for longer, or faster.")
    if float(np.ptp(np.concatenate(inputs))) == 0.0:
        raise BadInput("input", "one and the same", "a step, a ramp or several", "Change the input while recording.")
    measured = np.concatenate(speeds)
    if float(np.ptp(measured)) == 0.0:
        raise BadInput("output", "one and the same", "a motion", "Excite more, or check the sensor.")
    sets: list[tuple[Term, ...]] = [("friction", "load"), ("friction",), ("load",), ()] if _both_ways(measured) else [("offset",), ()]
    found = [_fitted(rate, inputs, speeds, terms) for terms in sets]
    best = shortest(found)
    unused = (given - sum(map(len, runs))) / rate
    return _answer(rate, units, inputs, (sets[best], found[best]), measured, unused)


def _shortened(runs: Sequence[Run]) -> list[Run]:
    """The first samples of all recordings, up to MOST."""
    kept, left = [], MOST
    for run in runs:
        if left >= FEWEST:
            kept.append(run.until(left / run.sampling_rate))
        left -= len(run)
    return kept


def _speed(run: Run) -> tuple[FloatArray, FloatArray]:
    """Input and speed (n,) at the same instants: as measured, or the mean from each sample to the next."""
    if run.measured == "acceleration":
        raise BadInput("output", "an acceleration", "a position or a velocity", "Use fit, which models it as it is.")
    speed = np.diff(run.position) * run.sampling_rate
    return run.voltage[: speed.size], speed


def _both_ways(measured: FloatArray) -> bool:
    """True if the speed has both directions."""
    least = TURNED * np.abs(measured).max()
    return bool(measured.min() < -least and measured.max() > least)


def _fitted(rate: float, inputs: Sequence[FloatArray], speeds: Sequence[FloatArray], terms: tuple[Term, ...]) -> Minimized:
    sizes, measured = [len(item) for item in speeds], np.concatenate(speeds)
    mean = np.array([float(np.mean(item[: max(2, len(item) // 50)])) for item in speeds])  # speed at the first sample

    def simulate(values: FloatArray) -> FloatArray:
        friction, load = _terms(values, terms)
        parts = [_run(u, rate, values[0], values[1], values[2], friction, load, v) for u, v in zip(inputs, mean, strict=True)]
        return np.concatenate(parts)

    longest = _longest(rate, inputs)
    large = 10.0 * max(float(np.max(np.abs(item))) for item in inputs)
    low = np.array([-np.inf, 0.05 / rate, 0.0, *([0.0] if "friction" in terms else []), *([-large] if set(terms) & {"load", "offset"} else [])])
    high = np.array(
        [np.inf, 4.0 * longest, longest, *([large] if "friction" in terms else []), *([large] if set(terms) & {"load", "offset"} else [])]
    )
    return solved(simulate, _starts(rate, inputs, speeds, terms, longest), measured, sizes, low, high)


def _longest(rate: float, inputs: Sequence[FloatArray]) -> float:
    """The longest delay that is searched, s."""
    return LONGEST * max(map(len, inputs)) / rate


def _terms(values: FloatArray, terms: tuple[Term, ...]) -> tuple[float, float]:
    """Friction and load of a row of parameters."""
    friction = float(values[3]) if "friction" in terms else 0.0
    load = float(values[3 + int("friction" in terms)]) if set(terms) & {"load", "offset"} else 0.0
    return friction, load


def _starts(rate: float, inputs: Sequence[FloatArray], speeds: Sequence[FloatArray], terms: tuple[Term, ...], longest: float) -> list[FloatArray]:
    """The best start values from a grid of time constants and delays; for each of them the rest is linear least squares."""
    step = max(sum(map(len, speeds)) // THINNED, 1)
    target = np.concatenate([item[::step] for item in speeds])
    turned = [np.sign(np.where(np.abs(v) > TURNED * np.abs(target).max(), v, 0.0)) for v in speeds]
    found: list[tuple[float, FloatArray]] = []
    for constant in np.geomspace(0.3 / rate, longest, CONSTANTS):
        keep = float(np.exp(-1.0 / (rate * constant)))
        for delay in {round(float(d)) for d in np.concatenate(([0.0, 1.0, 2.0], np.geomspace(3.0, max(longest * rate, 4.0), DELAYS)))}:
            columns = [[], [], [], []]  # type: list[list[FloatArray]]
            for u, v, way in zip(inputs, speeds, turned, strict=True):
                late = np.concatenate((np.full(min(delay, len(u)), u[0]), u))[: len(u)]
                for k, one in enumerate((late, way, np.ones(len(u)))):
                    columns[k].append(_lagged(one, keep)[::step])
                columns[3].append((v[0] * keep ** np.arange(len(u)))[::step])
            gain, against, load, first = (np.concatenate(item) for item in columns)
            used = [gain, *([against] if "friction" in terms else []), *([load] if set(terms) & {"load", "offset"} else []), first]
            matrix = np.column_stack(used)
            size, *_ = np.linalg.lstsq(matrix, target, rcond=None)
            if size[0] == 0.0:
                continue
            rest = -size[1:-1] / size[0]
            if "friction" in terms:
                rest[0] = max(rest[0], 1e-3 * float(np.max(np.abs(inputs[0]))))
            found.append((float(np.sum((target - matrix @ size) ** 2)), np.array([size[0], constant, delay / rate, *rest])))
    found.sort(key=lambda item: item[0])
    return [item[1] for item in found[:BEST]]


def _lagged(values: FloatArray, keep: float) -> FloatArray:
    """(n,) first-order response to held values, from rest at the first."""
    return np.asarray(scipy.signal.lfilter([0.0, 1.0 - keep], [1.0, -keep], values), dtype=np.float64)


def _answer(
    rate: float, units: Units, inputs: Sequence[FloatArray], found: tuple[tuple[Term, ...], Minimized], measured: FloatArray, unused: float
) -> FirstOrder:
    terms, best = found
    gain, constant = float(best.values[0]), float(best.values[1])
    one = np.eye(best.values.size)
    quantities = [
        best.quantity("gain", gain, one[0], units.of("m/s/V")),
        best.quantity("time_constant", constant, one[1], "s", positive=True),
        best.parameter("delay", 2, "s", 0.0, _longest(rate, inputs)),
        *(best.quantity(name, float(best.values[3 + k]), one[3 + k], units.input) for k, name in enumerate(terms)),
        best.quantity("kV", 1.0 / gain, -one[0] / gain**2, units.of("V/(m/s)")),
        best.quantity("kA", constant / gain, one[1] / gain - constant * one[0] / gain**2, units.of("V/(m/s2)"), gain > 0.0),
    ]
    if "friction" in terms:
        quantities.append(best.quantity("kS", float(best.values[3]), one[3], units.input))
    power = float(np.sum((measured - measured.mean()) ** 2))
    explained = 1.0 - float(np.sum((best.error - best.error.mean()) ** 2)) / power if power > 0.0 else 0.0
    lasting, levels = _levels(inputs)
    return FirstOrder(
        quantities=tuple(quantities),
        units=units,
        sampling_rate=rate,
        levels=levels,
        both_ways=_both_ways(measured),
        settled=lasting / rate / constant,
        error=best.cost,
        explained=explained,
        longest_delay=_longest(rate, inputs),
        seconds=measured.size / rate,
        unused=unused,
        repeats=best.error.size / best.independent / rate,
        terms=terms,
        measured=measured,
        simulated=measured - best.error,
    )


def _levels(inputs: Sequence[FloatArray]) -> tuple[int, int]:
    """Samples of the longest time at one level (a ramp has none), and how many levels the input stays at or passes."""
    every = np.concatenate(inputs)
    size = max(float(np.ptp(every)), 1e-300)
    longest = 0
    for u in inputs:
        edges = np.flatnonzero(np.abs(np.diff(u)) > LEVEL * size) + 1
        longest = max(longest, int(np.max(np.diff(np.concatenate(([0], edges, [len(u)]))))))
    return longest, int(np.unique(np.round((every - every.min()) / (LEVEL * size))).size)


@compiled
def _run(u: FloatArray, rate: float, gain: float, constant: float, delay: float, friction: float, load: float, first: float) -> FloatArray:
    """(n,) speeds at the instants of held inputs (n,), from a first speed; before the first sample the input was as in it."""
    period = 1.0 / rate
    whole = int(np.floor(delay * rate))
    part = delay - whole * period  # the input of sample n - whole - 1 acts for this long, then that of n - whole
    out = np.empty(u.shape[0])
    v = first
    hold = gain * friction
    if hold < 0.0:
        hold = -hold
    for n in range(u.shape[0]):
        out[n] = v
        for piece in range(2):
            k = n - whole - 1 + piece
            drive = gain * (u[k if k > 0 else 0] - load)
            left = part if piece == 0 else period - part
            for _ in range(3):
                if left <= 0.0:
                    break
                if v == 0.0:
                    if abs(drive) <= hold:
                        break
                    side = 1.0 if drive > 0.0 else -1.0
                else:
                    side = 1.0 if v > 0.0 else -1.0
                end = drive - side * hold
                after = end + (v - end) * np.exp(-left / constant)
                if after * side < 0.0:  # it stops within this step
                    left -= constant * np.log((v - end) / (-end))
                    v = 0.0
                else:
                    v = after
                    left = 0.0
    return out
