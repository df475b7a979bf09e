"""Screw compliance: the screw is a spring between motor and table."""

from __future__ import annotations

import math

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="screw_compliance",
    kind="structure",
    group="effect",
    law="f = k (x_motor - x_table) + c (x_motor' - x_table'); k = table_mass (2 pi frequency)^2",
    meaning="axial and torsional compliance of screw, nut and bearing",
    source="Varanasi & Nayfeh, The dynamics of lead-screw drives, J. Dyn. Sys. Meas. Control 126 (2004)",
    parameters=(
        Parameter("frequency", "Hz", 110.0, 95.0, 150.0, "table on the screw, motor locked: the antiresonance", 1.0, 2000.0, power=-0.5),
        Parameter("damping", "", 0.02, 0.01, 0.04, "damping ratio of that oscillation", 0.0, 2.0),
    ),
    family="resonance",
)


def stiffness(frequency: float, table_mass: float) -> float:
    """k, N/m."""
    return float(table_mass * (2.0 * math.pi * frequency) ** 2)


def dashpot(frequency: float, damping: float, table_mass: float) -> float:
    """c, N s/m."""
    return float(2.0 * damping * table_mass * 2.0 * math.pi * frequency)
