"""Dead zone: small commands have no effect."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="dead_zone",
    kind="input",
    group="effect",
    law="v = u - clip(u, -width, width)",
    meaning="amplifier cross-over, valve overlap, a threshold in the drive",
    source="Tao & Kokotovic, Adaptive Control of Systems with Actuator Nonlinearities, Wiley 1996, ch. 2",
    parameters=(Parameter("width", "V", 0.15, 0.05, 0.4, "half of the zone", 0.0, 100.0),),
)


@inlined
def output(width: float, u: float) -> float:
    """The output voltage for the voltage ``u``, V."""
    return u - min(max(u, -width), width)
