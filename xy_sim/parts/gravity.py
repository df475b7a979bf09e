"""Gravity: the weight of a joint's arm."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="gravity",
    kind="force",
    group="effect",
    law="f = -amplitude sin(q + phase); q is an angle, rad",
    meaning="a joint that lifts its arm, a pendulum",
    source="Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, 2nd ed., 2020, sec. 6.4",
    parameters=(
        Parameter("amplitude", "V", 0.5, 0.2, 2.0, "drive voltage that holds the arm level", 0.0, 1000.0),
        Parameter("phase", "rad", 0.0, -1.5, 1.5, "angle from where the arm hangs to the encoder's zero", -10.0, 10.0),
    ),
    drawn=False,
)


@inlined
def force(amplitude: float, phase: float, q: float) -> float:
    """Force on the arm at ``q`` (rad), V."""
    return -amplitude * (math.sin(phase) * math.cos(q) + math.cos(phase) * math.sin(q))


@inlined
def energy(amplitude: float, phase: float, q: float) -> float:
    """Potential at ``q`` (rad) above that at 0, V rad."""
    return 2.0 * amplitude * math.sin(0.5 * q) * math.sin(phase + 0.5 * q)


@inlined
def stiffness(amplitude: float, phase: float) -> float:
    """Force per angle at the encoder's zero, V/rad."""
    return amplitude * math.cos(phase)
