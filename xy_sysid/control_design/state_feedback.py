"""State feedback with an observer for the sampled linear part of a model: the largest bandwidth that holds for every sample of its parameters.

The plant is sampled exactly, with its delay as states (``sampled``). Gains come from two quadratic problems: the controller weighs the position's
error against the voltage, the observer weighs a force at the input against the encoder's noise. One number, the bandwidth, sets both weights. The
observer's estimate of the force is the integral of the error. The loop, broken at the voltage, has the margins of ``feedback`` for every sample of
the parameters. Of the observers with these margins the slowest is used: a faster one recovers more of the margins of the state feedback (loop
transfer recovery), but passes more of the encoder's noise. Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., Prentice Hall 1997,
ch. 11 (LQG); Anderson & Moore, Optimal Control: Linear Quadratic Methods, Prentice Hall 1990, ch. 8.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller, States
from xy_sysid.control_design.feedback import TURN, USUAL, Asked, Margins, first_kept, loop_systems, margins_with
from xy_sysid.control_design.sampled import LinearSystem, Sampled, looped, response_of
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

STEPS = 24  # number of bandwidths to test
FASTER = (3.0, 5.0, 8.0, 12.0, 20.0)  # observer's bandwidth over the controller's, so that its estimation error decays first
TOP = 0.45  # of the sampling rate, for the observer's bandwidth
INTEGRAL = 4.0  # bandwidth over the corner frequency of the integral


@dataclass(frozen=True, slots=True)
class StateFeedback:
    """z+ = free z + b (path - encoder) + drive held, u = c z, held = u within the drive's limit: observer and state feedback in one system.

    An encoder reading determines the voltage of the next sample: one period of calculation is part of the design.
    The observer uses the limited voltage, so it does not wind up. Within the limit z+ = a z + b (path - encoder).

    free: (n, n); b, c, drive: (n,); sampling_rate: Hz; bandwidth: rad/s, which sets the weights
    nominal, worst: margins of the loop broken at the voltage, of the model, and the least over ``count`` samples
    rejects: m, the largest position error after a step of load of 1 V; settles: s until it stays below a tenth of that
    """

    free: FloatArray
    b: FloatArray
    c: FloatArray
    drive: FloatArray
    sampling_rate: float
    bandwidth: float
    nominal: Margins
    worst: Margins
    count: int
    rejects: float
    settles: float

    def controller(self, limit: float) -> Controller:
        """The controller that a path is followed with; limit: V."""
        return Controller(0.0, 0.0, 0.0, limit=limit, states=States(self.free, self.b, self.c, self.drive))

    @property
    def a(self) -> FloatArray:
        """(n, n) transition within the limit."""
        return np.asarray(self.free + np.outer(self.drive, self.c))

    def response(self, frequency: FloatArray) -> ComplexArray:
        """(n,) voltage over error at frequencies, Hz."""
        return response_of(self.a, self.b, self.c, 0.0, frequency, self.sampling_rate)


def state_feedback(model: PhysicalModel, sampling_rate: float, asked: Asked = USUAL) -> StateFeedback:
    """The controller of the largest (or requested) bandwidth whose margins hold for every sample of the parameters.

    Raises BadInput if the data do not determine gain or pole, or if no bandwidth keeps the margins.
    """
    systems = loop_systems(model, sampling_rate)

    def designs() -> Iterator[_Design]:
        for tried, faster in itertools.product(asked.tries(sampling_rate, STEPS), FASTER):
            try:
                yield _Design(TURN * tried, *_designed(systems[0], TURN * tried, faster))
            except np.linalg.LinAlgError:  # the Riccati equation has no solution in double precision
                continue

    what = "bandwidth of the state feedback"
    made, nominal, worst = first_kept(what, asked, systems, designs(), lambda system, item: margins_with(system, item.within_limit))
    rejects, settles = _load_step(systems[0], made.within_limit)
    return StateFeedback(
        **made._asdict(),
        sampling_rate=sampling_rate,
        nominal=nominal,
        worst=worst,
        count=len(systems),
        rejects=rejects,
        settles=settles,
    )


class _Design(NamedTuple):
    """The part of ``StateFeedback`` that is tested for its margins."""

    bandwidth: float
    free: FloatArray
    b: FloatArray
    c: FloatArray
    drive: FloatArray

    @property
    def within_limit(self) -> LinearSystem:
        """(A, B, C, D) from error to voltage."""
        return self.free + np.outer(self.drive, self.c), self.b, self.c, 0.0


def _designed(system: Sampled, bandwidth: float, faster: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(free, b, c, drive) of the controller: its states are the observer's, which follow the encoder's error, and the integral of that error.

    The error's dynamics are those of the plant, as a constant path is an equilibrium. The observer estimates a force at the input, and the
    voltage compensates it: this is the integral. faster: the observer's bandwidth over ``bandwidth``, rad/s
    """
    plant, into, shown = system.whole_system()
    n, h = into.size, 1.0 / system.sampling_rate
    push = np.zeros(n)
    push[: system.old.size] = system.old + system.new  # a force that acts on the axis at once, in V
    size = _size(system, bandwidth)
    weight = size**2  # a voltage that moves the axis by one unit at the bandwidth costs as much as one unit of error
    feed = _regulator(plant, into, np.outer(shown, shown), weight)
    whole = np.block([[plant, push[:, None]], [np.zeros((1, n)), np.eye(1)]])
    seen = np.concatenate((shown, [0.0]))
    slow = bandwidth / INTEGRAL * h
    noise = np.outer(np.concatenate((push, [0.0])), np.concatenate((push, [0.0])))
    noise[n, n] = slow**2
    watching = min(faster * bandwidth, 2.0 * math.pi * TOP * system.sampling_rate)
    correct = _observer(whole, seen, noise, _size(system, watching) ** 2)
    on_the_way = float(np.sum(feed[system.old.size :]))  # at rest the delayed voltages balance the force
    gains = np.concatenate((feed, [1.0 + on_the_way]))
    drive = np.concatenate((into, [0.0]))
    return whole - np.outer(correct, seen), -correct, -gains, drive


def _size(system: Sampled, at: float) -> float:
    """Position over voltage at a frequency, rad/s."""
    return float(np.abs(system.response(np.array([at / (2.0 * math.pi)]))[0]))


def _regulator(a: FloatArray, b: FloatArray, states: FloatArray, voltage: float) -> FloatArray:
    """(n,) gains that minimise the sum of x' states x + voltage u^2."""
    p = scipy.linalg.solve_discrete_are(a, b[:, None], states, np.array([[voltage]]))
    return np.asarray((b @ p @ a) / (voltage + b @ p @ b))


def _observer(a: FloatArray, c: FloatArray, forces: FloatArray, noise: float) -> FloatArray:
    """(n,) gains of the stationary Kalman predictor."""
    p = scipy.linalg.solve_discrete_are(a.T, c[:, None], forces, np.array([[noise]]))
    return np.asarray((a @ p @ c) / (noise + c @ p @ c))


def _load_step(system: Sampled, controller: LinearSystem) -> tuple[float, float]:
    """The largest error after a step of 1 V of load, m, and the time until it stays below a tenth of that, s."""
    move = looped(system, controller)
    push = np.zeros(move.shape[0])
    push[: system.old.size] = system.old + system.new
    slowest = float(np.max(np.abs(np.linalg.eigvals(move))))
    count = int(min(max(-8.0 / math.log(slowest), 100.0), 1e5)) if slowest < 1.0 else 100
    state, place = np.zeros(move.shape[0]), np.zeros(count)
    for k in range(count):
        place[k] = state[0]
        state = move @ state + push
    top = float(np.max(np.abs(place)))
    late = np.flatnonzero(np.abs(place) > 0.1 * top)
    return top, float(late[-1] + 1) / system.sampling_rate if late.size else 0.0
