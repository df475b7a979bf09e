"""Free simulation of the position from the voltage alone, from the first sample to the last.

This is the hardest test, because small errors in velocity add up. Position-dependent laws (cogging) use the measured position,
as everywhere in this package.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel, simulator, start_of
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import arguments
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.block import FloatArray

ROUNDS = 40  # most rounds of least squares
STEP = 1e-4  # of a parameter's size, for its derivative
EDGE = 1e-9  # least distance from a bound, relative to a parameter's size
SLOW = ("friction", "bristle", "force", "input")  # categories that determine the slow motion, unless the law depends on position


@dataclass(frozen=True, slots=True)
class OpenLoop:
    """Measured minus simulated position over a whole record, from its first sample.

    error: (n,) m; speed: error of the start speed, m/s; rms, worst: m; share: rms over the standard deviation of the measured position
    """

    error: FloatArray
    speed: float
    rms: float
    worst: float
    share: float


def open_loop(sampling_rate: float, position: FloatArray, simulated: FloatArray, pole: float) -> OpenLoop:
    """Error of the position (n,), m, that follows from a simulated velocity (n - 1,), m/s.

    The error of the speed at the first sample, which decays with the pole (rad/s), is estimated.
    """
    started = _travelled(sampling_rate, _fading(sampling_rate, pole, simulated.size))
    drift = position - position[0] - _travelled(sampling_rate, simulated)
    lasting = float(started @ started)
    speed = float(drift @ started) / lasting if lasting > 0.0 else 0.0  # with a pole far above the sampling rate it decays at once
    error = drift - speed * started
    rms, spread = _rms(error), float(np.std(position))
    share = rms / spread if spread > 0.0 else np.inf
    return OpenLoop(error=error, speed=speed, rms=rms, worst=float(np.max(np.abs(error))), share=share)


def from_input_alone(sampling_rate: float, position: FloatArray, simulated: FloatArray, pole: float) -> tuple[float, float]:
    """(rms error of the position over the whole record, m; explained fraction 0..1 of the velocity's power); see ``open_loop``."""
    found = open_loop(sampling_rate, position, simulated, pole)
    measured = np.diff(position) * sampling_rate
    left = measured - simulated - found.speed * _fading(sampling_rate, pole, simulated.size)
    power = float(np.sum(measured**2))
    explained = 1.0 - float(np.sum(left**2)) / power if power > 0.0 else 0.0
    return found.rms, min(max(explained, 0.0), 1.0)


def _fading(sampling_rate: float, pole: float, samples: int) -> FloatArray:
    return np.asarray(np.exp(-pole * (np.arange(samples) + 0.5) / sampling_rate))


def settled(data: AxisData, fitted: GreyboxFit) -> GreyboxFit:
    """The same effects with the mass, drag, friction and load that predict the whole record best, in velocity and position.

    Output error (Ljung, System Identification, 2nd ed. 1999, sec. 7.2), with the speed at the first sample as one more unknown. Delay, modes
    and position-dependent effects are kept, since fast motion determines them better. Held-out errors remain those of ``fitted``, because this
    fit uses all data. Changed values have no interval (infinite): accumulated errors are not independent.
    """
    model = fitted.model
    free = [name for name, _ in model.effects if _slow(model.library[name])]
    items = [item for name in free for item in model.library[name].parameters]
    speed = float(np.std(data.velocity)) or 1.0
    begins = start_of(model, data.sampling_rate, data.voltage, data.position)
    start = np.array([model.gain, model.pole, 0.0, *(value for name, row in model.effects if name in free for value in row)])
    size = np.array([abs(model.gain), model.pole, speed, *(abs(item.typical) or min(1.0, item.high - item.low) for item in items)])
    signs = sorted((0.1 * model.gain, 10.0 * model.gain))
    low = np.array([signs[0], 0.1 * model.pole, -10.0 * speed, *(item.low for item in items)]) / size
    high = np.array([signs[1], 10.0 * model.pole, 10.0 * speed, *(item.high for item in items)]) / size
    run = simulator(model.library, [name for name, _ in model.effects], data.sampling_rate, data.voltage, data.position)
    target = data.position - data.position[0]
    far = _rms(target - _travelled(data.sampling_rate, fitted.simulated)) or 1.0
    fast = _rms(fitted.error) or 1.0

    def left(inner: FloatArray) -> FloatArray:
        values = inner * size
        moved = _moved(model, free, values)
        velocity = run(moved.row, begins) + values[2] * _fading(data.sampling_rate, moved.pole, data.velocity.size)
        drift = target - _travelled(data.sampling_rate, velocity)
        return np.concatenate((drift / far, (data.velocity - velocity) / fast))

    inside = np.clip(start / size, low + EDGE, high - EDGE)
    found = scipy.optimize.least_squares(left, inside, bounds=(low, high), diff_step=[STEP] * size.size, max_nfev=ROUNDS)
    values = found.x * size
    best = _moved(model, free, values)
    return _with(data, fitted, best, run(best.row, begins))


def _slow(effect: Effect) -> bool:
    return effect.category in SLOW and not any("x" in arguments(law) for law in effect.functions.values())


def _moved(model: AxisModel, free: list[str], values: FloatArray) -> AxisModel:
    """The model with gain, pole and the parameters of the free effects from one row, whose third number is the start speed."""
    rest = iter(values[3:].tolist())
    effects = tuple((name, tuple(next(rest) for _ in row) if name in free else row) for name, row in model.effects)
    return replace(model, gain=float(values[0]), pole=float(values[1]), effects=effects)


def _with(data: AxisData, fitted: GreyboxFit, model: AxisModel, simulated: FloatArray) -> GreyboxFit:
    values = model.values()
    estimates = tuple(
        item if item.value == values[item.name] else Estimate(name=item.name, value=values[item.name], unit=item.unit, low=-np.inf, high=np.inf)
        for item in fitted.parameters
    )
    return replace(fitted, model=model, parameters=estimates, simulated=simulated, error=data.velocity - simulated)


def _travelled(sampling_rate: float, velocity: FloatArray) -> FloatArray:
    """(n,) distance since the first sample, m."""
    return np.concatenate(([0.0], np.cumsum(velocity) / sampling_rate))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
