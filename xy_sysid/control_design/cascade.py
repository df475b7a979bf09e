"""The cascade of an ODrive, sample by sample: a phase-locked loop estimates angle and speed from the encoder, and P and PI act on these estimates.

The estimator is a filter in the loop, so its phase counts in the margins. With the encoder's reading m, bandwidth b, and a cycle of T s:

    p += T v, d = m - p, p += T 2 b d, v += T b^2 d
    e = position_gain (path - p) - v, u = velocity_gain e + i, i += T velocity_integral e

Source: ODrive firmware 0.5 (encoder.cpp, controller.cpp); its default bandwidth is 1000 rad/s, and its loops run at 8 kHz.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.feedback import INTEGRAL, POSITION, STEPS, TURN, USUAL, Asked, Margins, first_kept, loop_systems, margins_with, sign_of
from xy_sysid.control_design.sampled import LinearSystem, Sampled, response_of
from xy_sysid.control_design.uncertain import later

RATE, ESTIMATOR = 8000.0, 1000.0  # Hz of ODrive's loops; rad/s of its estimator, by default


@dataclass(frozen=True, slots=True)
class Cascade:
    """position_gain: 1/s; velocity_gain: V/(m/s); velocity_integral: V/m.

    nominal, worst: margins of the model, and the least over ``count`` samples of its parameters
    """

    position_gain: float
    velocity_gain: float
    velocity_integral: float
    nominal: Margins
    worst: Margins
    count: int


def cascade(model: PhysicalModel, asked: Asked = USUAL, calculation: float = 1.0) -> Cascade:
    """The gains of the largest (or requested) crossover whose margins, with the estimator, hold for every sample of the parameters.

    calculation: cycles from reading to writing. Raises BadInput as ``feedback`` does.
    """
    systems = loop_systems(later(model, calculation / RATE), RATE)
    tried = (shaped(systems[0], TURN * crossover) for crossover in asked.tries(RATE, STEPS))
    what = "bandwidth under ODrive's encoder estimator"
    own, nominal, worst = first_kept(what, asked, systems, tried, lambda system, item: margins_with(system, system_of(*item)))
    return Cascade(*own, nominal=nominal, worst=worst, count=len(systems))


def shaped(system: Sampled, crossover: float) -> tuple[float, float, float]:
    """Gains of the cascade whose loop gain with this system is 1 at the crossover, rad/s."""
    position, integral, at = crossover / POSITION, crossover / INTEGRAL, np.array([crossover / TURN])
    loop = system.response(at) * response_of(*system_of(position, 1.0, integral), at, RATE)
    size = math.copysign(1.0 / abs(complex(loop[0])), sign_of(system))
    return position, size, size * integral


def system_of(position_gain: float, velocity_gain: float, velocity_integral: float) -> LinearSystem:
    """(A, B, C, D) of the cascade from path minus encoder to voltage; states p, v and i."""
    t, b = 1.0 / RATE, ESTIMATOR
    seen = np.array([[1.0 - 2.0 * b * t, (1.0 - 2.0 * b * t) * t, 0.0], [-b * b * t, 1.0 - (b * t) ** 2, 0.0]])  # p and v after the reading
    fed = np.array([2.0 * b * t, b * b * t])
    error, direct = -(position_gain * seen[0] + seen[1]), position_gain * fed[0] + fed[1]
    a = np.vstack((seen, t * velocity_integral * error + [0.0, 0.0, 1.0]))
    return a, np.append(-fed, t * velocity_integral * direct), velocity_gain * error + [0.0, 0.0, 1.0], velocity_gain * direct
