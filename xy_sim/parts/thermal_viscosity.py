"""Thermal viscosity: the drag falls as motion warms the grease."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="thermal_viscosity",
    kind="friction",
    group="outside",
    law="drag -> drag (1 - depth h / (1 + h)); time h' = (v / speed)^2 - h",
    meaning="cold start: the drag falls as the machine warms up, faster with more motion",
    source="Seeton, Viscosity-temperature correlation for liquids, Tribol. Lett. 22 (2006); first-order warming",
    parameters=(
        Parameter("depth", "", 0.3, 0.15, 0.5, "largest relative loss of drag by warming", 0.0, 0.95),
        Parameter("time", "s", 15.0, 8.0, 30.0, "time constant of warming", 0.01, 1e5),
        Parameter("speed", "m/s", 0.04, 0.03, 0.06, "rms speed at which half of this is lost", 1e-6, 10.0),
    ),
)


@inlined
def factor(depth: float, heat: float) -> float:
    """Drag over its cold value."""
    return 1.0 - depth * heat / (1.0 + heat)


@inlined
def rate(time: float, speed: float, v: float, heat: float) -> float:
    """Change of heat (dimensionless), 1/s."""
    ratio = v / speed
    return (ratio * ratio - heat) / time
