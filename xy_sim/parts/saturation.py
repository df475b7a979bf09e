"""Saturation: the output of the amplifier is limited."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

# Of noise of 1 V rms, a limit of 1.6 V cuts off roughly ten times as much (rms) as one of 2.9 V: this gives the power.
PART = Part(
    name="saturation",
    kind="input",
    group="effect",
    law="v = clip(u, -limit, limit)",
    meaning="supply or current limit of the drive",
    source="Khalil, Nonlinear Systems, sec. 1.2",
    parameters=(Parameter("limit", "V", 1.5, 1.0, 2.2, "largest output voltage", 1e-9, 1e6, power=-0.25),),
)


@inlined
def output(limit: float, u: float) -> float:
    """Clipped voltage, V; limit 0 is no limit."""
    return min(max(u, -limit), limit) if limit > 0.0 else u
