"""Base resonance: the base is a mass on a spring, and the table accelerates it."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="base_resonance",
    kind="structure",
    group="effect",
    law="mass b'' + c b' + k b = -(force on the table); k = (mass + table_mass) (2 pi frequency)^2",
    meaning="machine frame on its feet or its bolts; the encoder, fixed to it, sees antiresonance before resonance",
    source="the paper, sec. 2 (47 Hz); Preumont, Vibration Control of Active Structures, 3rd ed., sec. 2.4",
    parameters=(
        Parameter("frequency", "Hz", 46.2, 25.0, 80.0, "base and table together with the screw locked: the antiresonance", 1.0, 2000.0, power=0.0),
        Parameter("mass", "kg", 120.0, 80.0, 200.0, "mass of the base", 0.1, 1e6, power=-1.0),
        Parameter("damping", "", 0.015, 0.01, 0.03, "damping ratio of that oscillation", 0.0, 2.0),
    ),
    family="resonance",
)


@inlined
def stiffness(moving: float, frequency: float) -> float:
    """k, N/m; moving: mass that moves with the screw locked, kg."""
    omega = 2.0 * math.pi * frequency
    return moving * omega * omega


@inlined
def dashpot(moving: float, frequency: float, damping: float) -> float:
    """c, N s/m."""
    return 4.0 * math.pi * damping * frequency * moving
