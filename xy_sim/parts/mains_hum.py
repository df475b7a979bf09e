"""Mains hum: a ripple of the mains in the motor voltage."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="mains_hum",
    kind="drive",
    group="imperfection",
    law="v -> v + ripple sin(w t + phase) + rectified sin(2 w t + 2 phase + 1); w = 2 pi mains",
    meaning="current ripple at the mains frequency and twice that, for any command",
    source="Mohan, Undeland & Robbins, Power Electronics, 3rd ed. 2003, ch. 5 (ripple of rectifiers)",
    parameters=(
        Parameter("ripple", "V", 0.02, 0.01, 0.05, "amplitude at the mains frequency", 0.0, 100.0),
        Parameter("rectified", "V", 0.02, 0.01, 0.05, "amplitude at twice the mains frequency", 0.0, 100.0, power=1.0),
        Parameter("mains", "Hz", 50.0, 50.0, 50.0, "mains frequency", 1.0, 1000.0),
        Parameter("phase", "rad", 0.0, -3.0, 3.0, "phase at the start", -10.0, 10.0),
    ),
    drawn=False,
)


@inlined
def volts(ripple: float, rectified: float, mains: float, phase: float, t: float) -> float:
    """The added voltage at ``t`` (s), V."""
    a = 2.0 * math.pi * mains * t + phase
    return ripple * math.sin(a) + rectified * math.sin(2.0 * a + 1.0)
