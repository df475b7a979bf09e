"""A model on its own from the first sample to the last: the position that it predicts from the voltage alone.

The hardest test, as every small error in velocity adds up. What depends on position in a model (cogging) is simulated at the
measured one, as everywhere here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from xy_sysid.axis_model import AxisModel, simulate, simulator
from xy_sysid.effects import Effect
from xy_sysid.effects.contract import arguments
from xy_sysid.greybox import AxisData, Estimate, GreyboxFit
from xy_sysid.stream import FloatArray

ROUNDS = 40  # of the least squares
STEP = 1e-4  # of a parameter's size, for its derivative
EDGE = 1e-9  # of a parameter's size, from its bound
SLOW = ("friction", "bristle", "force", "input")  # categories that decide the slow motion, unless they go with position


@dataclass(frozen=True, slots=True)
class OpenLoop:
    """Measured minus simulated position over a whole record, from its first sample.

    error: (n,) m; rms, worst: m; share: rms over the standard deviation of the measured position
    """

    error: FloatArray
    rms: float
    worst: float
    share: float


def open_loop(sampling_rate: float, position: FloatArray, simulated: FloatArray) -> OpenLoop:
    """What a simulated velocity (n - 1,), m/s, from rest, makes of the position (n,), m."""
    error = position - position[0] - _travelled(sampling_rate, simulated)
    rms, spread = _rms(error), float(np.std(position))
    return OpenLoop(error, rms, float(np.max(np.abs(error))), rms / spread if spread > 0.0 else np.inf)


def settled(data: AxisData, fitted: GreyboxFit) -> GreyboxFit:
    """The same effects with the drag, friction and load that predict the whole record best, in velocity and position.

    Output error (Ljung, System Identification, 2nd ed. 1999, sec. 7.2). What the fast motion knows better stays as it was:
    delay, gain x pole (mass), modes, and what goes with position. Errors on held-out data stay those of ``fitted``, as now
    there is nothing that no fit saw. Values that moved have no interval (infinite): errors that add up are not independent.
    """
    model = fitted.model
    free = [name for name, _ in model.effects if _slow(model.library[name])]
    items = [item for name in free for item in model.library[name].parameters]
    start = np.array([model.gain, *(value for name, row in model.effects if name in free for value in row)])
    size = np.array([abs(model.gain), *(abs(item.typical) or min(1.0, item.high - item.low) for item in items)])
    low = np.array([min(0.1 * model.gain, 10.0 * model.gain), *(item.low for item in items)]) / size
    high = np.array([max(0.1 * model.gain, 10.0 * model.gain), *(item.high for item in items)]) / size
    run = simulator(model.library, [name for name, _ in model.effects], data.sampling_rate, data.voltage, data.position)
    target = data.position - data.position[0]
    far = _rms(target - _travelled(data.sampling_rate, fitted.simulated)) or 1.0
    fast = _rms(fitted.error) or 1.0

    def left(inner: FloatArray) -> FloatArray:
        velocity = run(np.array(list(_moved(model, free, inner * size).values().values())))
        drift = target - _travelled(data.sampling_rate, velocity)
        return np.concatenate((drift / far, (data.velocity - velocity) / fast))

    inside = np.clip(start / size, low + EDGE, high - EDGE)
    found = least_squares(left, inside, bounds=(low, high), diff_step=[STEP] * size.size, max_nfev=ROUNDS)
    return _with(data, fitted, _moved(model, free, found.x * size))


def _slow(effect: Effect) -> bool:
    return effect.category in SLOW and not any("x" in arguments(law) for law in effect.functions.values())


def _moved(model: AxisModel, free: list[str], values: FloatArray) -> AxisModel:
    """Gain (the pole goes with it) and the parameters of the free effects, from one row."""
    rest = iter(values[1:].tolist())
    effects = tuple((name, tuple(next(rest) for _ in row) if name in free else row) for name, row in model.effects)
    gain = float(values[0])
    return replace(model, gain=gain, pole=model.gain * model.pole / gain, effects=effects)


def _with(data: AxisData, fitted: GreyboxFit, model: AxisModel) -> GreyboxFit:
    simulated = simulate(model, data.sampling_rate, data.voltage, data.position)
    values = model.values()
    estimates = tuple(
        item if item.value == values[item.name] else Estimate(item.name, values[item.name], item.unit, -np.inf, np.inf) for item in fitted.parameters
    )
    return replace(fitted, model=model, parameters=estimates, simulated=simulated, error=data.velocity - simulated)


def _travelled(sampling_rate: float, velocity: FloatArray) -> FloatArray:
    """(n,) m since the first sample."""
    return np.concatenate(([0.0], np.cumsum(velocity) / sampling_rate))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
