"""A position-controlled joint with known target and angle: the controller is part of the model.

    q'' = limited(kp (target - q)) - damping q' - friction sign(q') - load      all divided by the inertia

As MuJoCo's position actuator (kp, forcerange; damping, frictionloss, armature of the joint). Target and angle contain no mass and no
torque, so every number is divided by the inertia: 1/s^2, 1/s, rad/s^2. A derivative gain of the controller has the effect of joint damping.
Between samples the target is held; steps are implicit in friction and damping, and stops are exact (Moreau 1988; Stewart & Trinkle 1996).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.time_models.output_error import Minimized, Told, shortest, solved
from xy_sysid.units import Units

FINEST = 1e-3  # s, of a step
FEWEST = 40  # samples in all
SHORTEST = 8  # samples of a recording that is used
HELD = 4  # every fourth recording is held out; with fewer, the last quarter of each
FREQUENCIES, DAMPINGS, DELAYS = (5.0, 10.0, 20.0, 40.0, 80.0), (0.3, 0.7, 1.5), (0.5, 2.5)  # rad/s, ratios and samples of the starts
LONGEST_DELAY = 0.25  # s
BEST = 3  # start values that are fitted
REACHED = 0.02  # fraction of the time at the limit from which the limit is determined
STILL = 0.02  # of the target's range: a smaller change of an angle counts as rest


@dataclass(frozen=True, slots=True)
class Servo:
    """The result from target and angle.

    quantities:   stiffness (kp / inertia), damping (kd and damping of the joint, / inertia), friction, load, limit (/ inertia), delay; then
                  frequency (Hz) and damping_ratio of the closed loop
    at_limit:     fraction of the time with the torque at its limit, 0 without one; reached: largest requested torque / inertia
    error, explained: rms of the angle's error and explained fraction of its power, on held-out data; fitted_error: rms on the fitted data
    resolution:   step of the angle's sensor; recordings: number of used recordings
    """

    quantities: tuple[Told, ...]
    units: Units
    sampling_rate: float
    at_limit: float
    reached: float
    error: float
    explained: float
    fitted_error: float
    resolution: float
    recordings: int
    measured: FloatArray
    simulated: FloatArray

    def __getitem__(self, name: str) -> Told:
        """A quantity by its name; raises KeyError."""
        return {item.name: item for item in self.quantities}[name]


def servo(runs: Sequence[Run]) -> Servo:
    """Fit of target (the input) to angle of one or several recordings. Raises BadInput for too few samples or angles that do not follow."""
    used = [run for run in runs if len(run) >= SHORTEST and float(np.ptp(run.voltage)) > 0.0]
    if sum(map(len, used)) < FEWEST:
        act = "Record for longer, with targets that change."
        raise BadInput("number of samples with a target that changes", sum(map(len, used)), f"{FEWEST} or more", act)
    first = used[0]
    if first.measured != "position" or first.input_unit != first.output_unit:
        given = f"{first.input_unit} to {first.units.measured}"
        raise BadInput("units", given, "a target and a position in one and the same unit", "Give them with --unit, for example input=rad,output=rad.")
    seen, unseen = _split(used)
    free, limited = (_fitted(seen, with_limit) for with_limit in (False, True))
    at_limit = shortest((limited, free)) == 0 and _at_limit(seen, limited.values) > REACHED
    return _answer(used, seen, unseen, limited if at_limit else free, at_limit)


def _split(runs: list[Run]) -> tuple[list[Run], list[Run]]:
    """(recordings to fit, held-out recordings)."""
    if len(runs) >= 2 * HELD:
        return [run for k, run in enumerate(runs) if k % HELD != HELD - 1], [run for k, run in enumerate(runs) if k % HELD == HELD - 1]
    cut = [len(run) - len(run) // HELD for run in runs]
    return [run.until(n / run.sampling_rate) for run, n in zip(runs, cut, strict=True)], [run.after(n) for run, n in zip(runs, cut, strict=True)]


def _fitted(runs: list[Run], limited: bool) -> Minimized:
    rate = runs[0].sampling_rate
    measured = np.concatenate([run.position for run in runs])
    span = max(float(np.ptp(np.concatenate([run.voltage for run in runs]))), 1e-9)

    def simulate(values: FloatArray) -> FloatArray:
        return np.concatenate([_simulated(run, values) for run in runs])

    starts = []
    for frequency in FREQUENCIES:
        for ratio, late in itertools.product(DAMPINGS, DELAYS):
            row = [frequency**2, 2.0 * ratio * frequency, 0.01 * span * frequency**2, late / rate, 0.0]
            starts.append(np.array([*row, 0.5 * span * frequency**2] if limited else row))
    starts.sort(key=lambda row: float(np.sum((measured - simulate(row)) ** 2)))
    low = np.array([1.0, 0.0, 0.0, 0.0, -1e4 * span, *([1e-3 * span] if limited else [])])
    high = np.array([1e6, 1e4, 1e4 * span, LONGEST_DELAY, 1e4 * span, *([1e6 * span] if limited else [])])
    return solved(simulate, starts[:BEST], measured, [len(run) for run in runs], low, high)


def _simulated(run: Run, values: FloatArray) -> FloatArray:
    """(n,) angles, from the first one measured and its speed."""
    rate = run.sampling_rate
    speed = float(run.position[min(2, len(run) - 1)] - run.position[0]) * rate / 2.0 if len(run) > 2 else 0.0
    still = STILL * max(float(np.ptp(run.voltage)), 1e-12)
    first = 0.0 if abs(speed) / rate < still else speed
    stiffness, damping, friction, delay, load = (float(value) for value in values[:5])
    limit = float(values[5]) if values.size > 5 else np.inf
    return _run(run.voltage, rate, stiffness, damping, friction, delay, load, limit, float(run.position[0]), first)


def _at_limit(runs: Sequence[Run], values: FloatArray) -> float:
    """Fraction of the samples at which the requested torque is at least the limit."""
    if values.size < 6:
        return 0.0
    asked = np.concatenate([np.abs(values[0] * (run.voltage - _simulated(run, values))) for run in runs])
    return float(np.mean(asked >= values[5]))


def _answer(used: list[Run], seen: list[Run], unseen: list[Run], best: Minimized, limited: bool) -> Servo:
    units = used[0].units
    one, v = np.eye(best.values.size), best.values
    root = float(np.sqrt(v[0]))
    ratio = float(v[1] / (2.0 * root))
    per = units.output
    quantities = [
        best.quantity("stiffness", float(v[0]), one[0], "1/s^2", positive=True),
        best.quantity("damping", float(v[1]), one[1], "1/s"),
        best.quantity("friction", float(v[2]), one[2], f"{per}/s^2"),
        best.quantity("load", float(v[4]), one[4], f"{per}/s^2"),
        *([best.quantity("limit", float(v[5]), one[5], f"{per}/s^2", positive=True)] if limited else []),
        best.parameter("delay", 3, "s", 0.0, LONGEST_DELAY),
        best.quantity("frequency", root / (2.0 * np.pi), one[0] / (4.0 * np.pi * root), "Hz", positive=True),
        best.quantity("damping_ratio", ratio, one[1] / (2.0 * root) - one[0] * v[1] / (4.0 * root**3), ""),
    ]
    judged = [run for run in unseen if len(run) > 1]
    measured, simulated = (np.concatenate(parts) for parts in ([run.position for run in judged], [_simulated(run, v) for run in judged]))
    power = float(np.sum((measured - measured.mean()) ** 2))
    error = measured - simulated
    steps = np.abs(np.diff(np.concatenate([run.position for run in used])))
    return Servo(
        quantities=tuple(quantities),
        units=units,
        sampling_rate=used[0].sampling_rate,
        at_limit=_at_limit(seen, v) if limited else 0.0,
        reached=float(max(np.max(np.abs(v[0] * (run.voltage - run.position))) for run in used)),
        error=float(np.sqrt(np.mean(error**2))),
        explained=1.0 - float(np.sum(error**2)) / power if power > 0.0 else 0.0,
        fitted_error=best.cost,
        resolution=float(np.min(steps[steps > 0.0])) if bool(np.any(steps > 0.0)) else 0.0,
        recordings=len(used),
        measured=measured,
        simulated=simulated,
    )


@compiled
def _run(
    target: FloatArray,
    rate: float,
    stiffness: float,
    damping: float,
    friction: float,
    delay: float,
    load: float,
    limit: float,
    start: float,
    speed: float,
) -> FloatArray:
    """(n,) angles at the instants of held targets (n,); before the first, the target was the start angle."""
    steps = int(np.ceil(1.0 / (rate * FINEST)))
    dt = 1.0 / (rate * steps)
    late = delay * rate
    out = np.empty(target.shape[0])
    q, v = start, speed
    for n in range(target.shape[0]):
        out[n] = q
        for k in range(steps):
            end = n + (k + 1.0) / steps - late  # mean of the held target over this step, so that a delay need not be an integer number of steps
            place = int(np.floor(end))
            after = min((end - place) * steps, 1.0)
            now = target[min(place, target.shape[0] - 1)] if place >= 0 else start
            before = target[min(place - 1, target.shape[0] - 1)] if place >= 1 else start
            asked = stiffness * (after * now + (1.0 - after) * before - q)
            free = (v + dt * (min(max(asked, -limit), limit) - load)) / (1.0 + dt * damping)
            stop = dt * friction
            v = max(free - stop, 0.0) + min(free + stop, 0.0)
            q += dt * v
    return out
