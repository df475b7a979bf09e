"""Loose mode: a second mass with clearance on the table."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="loose_mode",
    kind="structure",
    group="outside",
    law="f = contact(x_table - x_mass, gap / 2), stiffness = mass (2 pi frequency)^2",
    meaning="a clamped workpiece or cover that came loose: no contact for small motion, elastic for large motion",
    source="Worden & Tomlinson 2001, sec. 2.2.6 (clearance); contact after Hunt & Crossley 1975",
    parameters=(
        Parameter("mass", "kg", 5.0, 3.0, 8.0, "loose mass", 0.01, 1e4),
        Parameter("frequency", "Hz", 90.0, 60.0, 140.0, "frequency while in contact", 1.0, 2000.0),
        Parameter("gap", "m", 20e-6, 10e-6, 50e-6, "free play", 0.0, 0.1),
        Parameter("damping", "s/m", 5.0, 3.0, 10.0, "loss of the contact per approach speed"),
    ),
)


@inlined
def stiffness(mass: float, frequency: float) -> float:
    """Contact stiffness, N/m."""
    omega = 2.0 * math.pi * frequency
    return mass * omega * omega
