"""Weak modes: two small masses oscillate on the table."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="weak_modes",
    kind="structure",
    group="imperfection",
    law="f = k (x_table - x_mass) + c (x_table' - x_mass') for each; k = mass (2 pi frequency)^2, c = 2 damping mass 2 pi frequency",
    meaning="covers, cable chain, clamps: every machine has further modes",
    source="Preumont, Vibration Control of Active Structures, 3rd ed., sec. 2.4",
    parameters=(
        Parameter("mass", "kg", 0.1, 0.02, 0.3, "mass of the first mode", 0.0, 1e4),
        Parameter("second_mass", "kg", 0.05, 0.02, 0.3, "mass of the second mode", 0.0, 1e4, power=1.0),
        Parameter("frequency", "Hz", 70.0, 35.0, 120.0, "frequency of the first mode with the table held", 1.0, 2000.0),
        Parameter("second_frequency", "Hz", 190.0, 130.0, 280.0, "frequency of the second mode with the table held", 1.0, 2000.0),
        Parameter("damping", "", 0.03, 0.02, 0.06, "damping ratio of both", 0.0, 2.0),
    ),
    drawn=False,
)


@inlined
def force(mass: float, frequency: float, damping: float, x: float, v: float) -> float:
    """Force on a mass that the table leads by ``x`` (m) and ``v`` (m/s), N."""
    omega = 2.0 * math.pi * frequency
    return mass * omega * (omega * x + 2.0 * damping * v)
