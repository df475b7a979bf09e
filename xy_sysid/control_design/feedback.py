"""PID and cascaded P-PI for a refined model: the largest bandwidth whose margins hold for every sample of its parameters.

The controller is kd (s + w / POSITION) (s + w / INTEGRAL) / s with a low-pass on the derivative, w the crossover in rad/s. That is a velocity loop
with gain kd and integral time INTEGRAL / w inside a position loop with gain w / POSITION and the path's speed fed forward: the ordinary servo
drive; and it is a PID. Margins and stability are those of the sampled loop, with hold and delay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import NO_LIMIT, Controller, Encoder
from xy_sysid.control_design.sampled import (
    LinearSystem,
    Sampled,
    closed_poles,
    controller_response,
    grid,
    looped_poles,
    noise_to_voltage,
    on_grid,
    response_of,
    sampled,
)
from xy_sysid.control_design.uncertain import samples, undetermined
from xy_sysid.errors import BadInput
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

POSITION, INTEGRAL = 4.0, 10.0  # crossover over the corner of the position loop and of the integral: they cost 14 and 6 degrees of phase
DERIVATIVE = 8.0  # cut-off of the derivative's low-pass over the crossover: it costs 7 degrees
PHASE_MARGIN, GAIN_MARGIN = 45.0, 2.0  # degrees, factor: Astrom & Murray, Feedback Systems, 2nd ed., sec. 10.3 ask for 30 to 60 and 2 to 5
MOST_PHASE, MOST_GAIN = 90.0, 100.0  # largest margins that may be requested
COUNT = 24  # samples of the parameters
STEPS = 60  # number of crossovers to test
TURN = 2.0 * math.pi  # rad
HIGHEST = 0.25  # of the sampling rate, for a crossover
ADVICE = "Ask for less bandwidth or smaller margins, or sample faster."
ToTry = TypeVar("ToTry")


@dataclass(frozen=True, slots=True)
class Margins:
    """phase: degrees; gain: factor upwards; sensitivity: largest 1 / |1 + L|; crossover: Hz, the highest; stable: of the closed loop."""

    phase: float
    gain: float
    sensitivity: float
    crossover: float
    stable: bool


@dataclass(frozen=True, slots=True)
class Asked:
    """The requirements of a loop. phase: degrees; gain: factor upwards; bandwidth: crossover, Hz (None: the largest).

    Raises BadInput for margins out of range.
    """

    phase: float = PHASE_MARGIN
    gain: float = GAIN_MARGIN
    bandwidth: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.phase < MOST_PHASE:
            raise BadInput("phase margin", f"{self.phase:g} degrees", f"above 0, below {MOST_PHASE:g} degrees", "Ask for 30 to 60 degrees.")
        if not 1.0 < self.gain <= MOST_GAIN:
            raise BadInput("gain margin", f"{self.gain:g}", f"above 1, up to {MOST_GAIN:g} (times, not dB)", "Ask for 2 to 5.")

    def tries(self, sampling_rate: float, steps: int) -> list[float]:
        """The crossovers to test, Hz, the largest first. Raises BadInput for a bandwidth out of range."""
        if self.bandwidth is None:
            return [float(item) for item in np.geomspace(HIGHEST * sampling_rate, 1e-4 * sampling_rate, steps)]
        if not 0.0 < self.bandwidth <= HIGHEST * sampling_rate:
            raise BadInput("bandwidth", f"{self.bandwidth:g} Hz", f"above 0, up to {HIGHEST * sampling_rate:g} Hz", "Give another.")
        return [self.bandwidth]

    def refused(self, what: str, worst: Margins) -> BadInput:
        """The error if no crossover keeps the margins; worst: margins of the last one."""
        said = f"phase margin {worst.phase:.3g} degrees and gain margin {worst.gain:.3g}" if worst.stable else "unstable"
        given = f"{self.bandwidth:g} Hz" if self.bandwidth is not None else "any"
        return BadInput(what, f"{given}: {said}", f"at least {self.phase:g} degrees and {self.gain:g}", ADVICE)

    def met(self, found: Margins) -> bool:
        """Whether a loop is stable and has both margins."""
        return found.stable and found.phase >= self.phase and found.gain >= self.gain


USUAL = Asked()


@dataclass(frozen=True, slots=True)
class Feedback:
    """A controller with its margins.

    controller: as ``closed_loop`` runs it; sampling_rate: Hz; crossover: rad/s, of the design
    asked: the requirements; nominal, worst: margins of the model, and the least of each over ``count`` samples
    bare: the least margins without the low-pass on the derivative, which some controllers lack; counted: with times in whole ms
    bandwidth: Hz, where the closed loop falls below -3 dB
    noise: V rms due to encoder noise and counts, the largest of the first 4 samples; short: the limiting margin, ``phase`` or ``gain``
    """

    controller: Controller
    sampling_rate: float
    crossover: float
    asked: Asked
    nominal: Margins
    worst: Margins
    bare: Margins
    counted: Margins
    count: int
    bandwidth: float
    noise: float
    short: str

    @property
    def position_gain(self) -> float:
        """Position gain of a servo drive, 1/s."""
        return self.crossover / POSITION

    @property
    def velocity_gain(self) -> float:
        """Velocity gain of a servo drive, V/(m/s)."""
        return self.controller.kd

    @property
    def velocity_integral(self) -> float:
        """Integral gain of the velocity loop, V/m."""
        return self.controller.kd * self.crossover / INTEGRAL

    @property
    def integral_time(self) -> float:
        """Integral time of the velocity loop, s."""
        return INTEGRAL / self.crossover


def shaped(system: Sampled, crossover: float, sections: FloatArray, limit: float = NO_LIMIT) -> Controller:
    """The controller whose loop gain with this system is 1 at the crossover, rad/s."""
    kp, ki = crossover / POSITION, crossover / INTEGRAL
    one = Controller(kp=kp + ki, ki=kp * ki, kd=1.0, derivative_time=1.0 / (DERIVATIVE * crossover), sections=sections, limit=limit)
    at = np.array([crossover / (2.0 * math.pi)])
    plant = system.response(at)[0]
    size = 1.0 / abs(plant * controller_response(one, at, system.sampling_rate)[0])
    size = math.copysign(float(size), sign_of(system))
    return Controller(kp=size * one.kp, ki=size * one.ki, kd=size, derivative_time=one.derivative_time, sections=sections, limit=limit)


def sign_of(system: Sampled) -> float:
    """Sign of the final motion for a positive voltage."""
    slow = np.array([1e-5 * system.sampling_rate])
    return -1.0 if float(np.imag(system.response(slow)[0])) > 0.0 else 1.0


def margins(system: Sampled, controller: Controller) -> Margins:
    """Margins of the sampled loop."""
    loop = on_grid(system) * controller_response(controller, grid(system), system.sampling_rate)
    return margins_of(loop, grid(system), closed_poles(system, controller))


def margins_with(system: Sampled, controller: LinearSystem) -> Margins:
    """Margins of the sampled loop with any linear controller from error to voltage."""
    own = response_of(*controller, grid(system), system.sampling_rate)
    return margins_of(on_grid(system) * own, grid(system), looped_poles(system, controller))


def margins_of(loop: ComplexArray, frequency: FloatArray, poles: ComplexArray) -> Margins:
    """Margins of an open loop at frequencies, Hz, interpolated linearly in decibels and degrees; poles: of the closed loop.

    Source: Astrom & Murray, Feedback Systems, 2nd ed., sec. 10.3.
    """
    size, turn = np.log(np.abs(loop)), np.unwrap(np.angle(loop))
    crossing = np.flatnonzero(size[:-1] * size[1:] <= 0.0)
    there = _share(size, crossing, 0.0)
    phases = np.abs((_between(turn, crossing, there) + 2.0 * math.pi) % (2.0 * math.pi) - math.pi)
    odd = np.floor((turn + math.pi) / (2.0 * math.pi))
    passing = np.flatnonzero(odd[:-1] != odd[1:])
    level = 2.0 * math.pi * np.maximum(odd[passing], odd[passing + 1]) - math.pi
    gains = np.exp(-_between(size, passing, _share(turn, passing, level)))
    return Margins(
        phase=float(np.degrees(np.min(phases, initial=math.pi))),
        gain=float(np.min(gains[gains > 1.0], initial=math.inf)),
        sensitivity=float(np.max(1.0 / np.abs(1.0 + loop))),
        crossover=float(_between(frequency, crossing, there)[-1]) if crossing.size else 0.0,
        stable=bool(np.max(np.abs(poles)) < 1.0),
    )


def _share(values: FloatArray, at: NDArray[np.intp], level: FloatArray | float) -> FloatArray:
    """Fraction of the distance from each value to the next at which a level is crossed."""
    return np.asarray((level - values[at]) / (values[at + 1] - values[at] + 1e-300))


def _between(values: FloatArray, at: NDArray[np.intp], share: FloatArray) -> FloatArray:
    return np.asarray(values[at] + share * (values[at + 1] - values[at]))


def least(found: Sequence[Margins]) -> Margins:
    """The least of each margin, and the largest sensitivity."""
    return Margins(
        phase=min(item.phase for item in found),
        gain=min(item.gain for item in found),
        sensitivity=max(item.sensitivity for item in found),
        crossover=min(item.crossover for item in found),
        stable=all(item.stable for item in found),
    )


def feedback(
    model: PhysicalModel,
    sampling_rate: float,
    asked: Asked = USUAL,
    sections: FloatArray | None = None,
    encoder: Encoder | None = None,
    limit: float = NO_LIMIT,
) -> Feedback:
    """The controller of the largest (or requested) crossover whose margins hold for every sample of the parameters.

    sections: filters in series with the feedback, (k, 5); encoder: for its noise; limit: of the drive, V
    Raises BadInput if the data do not determine gain or pole, or if no crossover keeps the margins.
    """
    systems = loop_systems(model, sampling_rate)
    filters = np.zeros((0, 5)) if sections is None else sections
    tried = ((crossover, shaped(systems[0], crossover, filters, limit)) for crossover in (TURN * item for item in asked.tries(sampling_rate, STEPS)))
    (crossover, controller), *found = first_kept("bandwidth", asked, systems, tried, lambda system, item: margins(system, item[1]))
    return _made(systems, controller, crossover, asked, (found[0], found[1]), encoder or Encoder())


def loop_systems(model: PhysicalModel, sampling_rate: float) -> list[Sampled]:
    """The systems with which a loop must keep its margins: the sampled model as fitted, with samples of its parameters, the motor inside a gap.

    Raises BadInput if the data do not determine gain or pole.
    """
    doubtful = undetermined(model, ("gain", "pole"))
    if model.parameters and doubtful:
        raise BadInput(
            " and ".join(doubtful), "known to worse than a factor of two", "numbers that the data determine", "Record a livelier motion first."
        )
    own = samples(model, COUNT)
    return [sampled(item, sampling_rate) for item in (*own, *within_a_gap(own[0]))]


def first_kept(
    what: str, asked: Asked, systems: Sequence[Sampled], tried: Iterable[ToTry], of: Callable[[Sampled, ToTry], Margins]
) -> tuple[ToTry, Margins, Margins]:
    """The first controller that keeps the margins with every system; the margins with the first system, and the least.

    of: margins of a system under a controller. Raises BadInput with the margins of the last controller if none keeps them.
    """
    worst = Margins(phase=0.0, gain=0.0, sensitivity=math.inf, crossover=0.0, stable=False)
    for item in tried:
        nominal = worst = of(systems[0], item)
        if asked.met(nominal) and nominal.crossover > 0.0:  # a loop gain that never reaches 1 has no effect
            worst = least([of(system, item) for system in systems])
            if asked.met(worst):
                return item, nominal, worst
    raise asked.refused(what, worst)


def within_a_gap(model: AxisModel) -> tuple[AxisModel, ...]:
    """The motor alone, if an effect has its share of the mass: inside an open gap the loop drives less mass and must keep its margins."""
    found = []
    for name, values in model.effects:
        share = dict(zip(model.library[name].names, values, strict=True)).get("share")
        if share is not None:
            found.append(replace(model, pole=model.pole / share))
    return tuple(found)


def in_milliseconds(controller: Controller) -> Controller:
    """The controller with its integral, derivative and filter times rounded to whole milliseconds, at least one."""

    def rounded(seconds: float) -> float:
        return 1e-3 * max(round(1e3 * seconds), 1.0)

    kp = controller.kp
    ki, kd = kp / rounded(kp / controller.ki), kp * rounded(controller.kd / kp)
    return replace(controller, ki=ki, kd=kd, derivative_time=rounded(controller.derivative_time))


def _made(
    systems: list[Sampled], controller: Controller, crossover: float, asked: Asked, found: tuple[Margins, Margins], encoder: Encoder
) -> Feedback:
    rate = systems[0].sampling_rate
    frequency = grid(systems[0])
    loop = on_grid(systems[0]) * controller_response(controller, frequency, rate)
    low = np.flatnonzero(np.abs(loop / (1.0 + loop)) < math.sqrt(0.5))
    seen = math.hypot(encoder.noise, encoder.count / math.sqrt(12.0))
    worst = found[1]
    return Feedback(
        controller=controller,
        sampling_rate=rate,
        crossover=crossover,
        asked=asked,
        nominal=found[0],
        worst=worst,
        bare=least([margins(system, replace(controller, derivative_time=0.0)) for system in systems]),
        counted=least([margins(system, in_milliseconds(controller)) for system in systems]),
        count=len(systems),
        bandwidth=float(frequency[low[0]]) if low.size else 0.5 * rate,
        noise=seen * max(noise_to_voltage(system, controller) for system in systems[:4]),
        short="phase" if worst.phase / asked.phase < worst.gain / asked.gain else "gain",
    )
