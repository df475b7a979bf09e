"""Gain drift: the gain of the drive changes linearly with time."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="gain_drift",
    kind="drive",
    group="effect",
    law="v -> v (1 + clip(rate t, -limit, limit))",
    meaning="magnets and amplifier warm up",
    source="Krishnan, Permanent Magnet Synchronous and Brushless DC Motor Drives, 2010, sec. 1.3 (remanence -0.1 %/K)",
    parameters=(
        Parameter("rate", "1/s", -0.002, 0.001, 0.005, "change of the gain per second, as a part of it", -10.0, 10.0, True),
        Parameter("limit", "", 0.3, 0.3, 0.3, "largest change", 0.0, 0.99),
    ),
)


@inlined
def factor(rate: float, limit: float, t: float) -> float:
    """Gain at ``t`` (s) over the gain at the start."""
    return 1.0 + min(max(rate * t, -limit), limit)
