"""Resistance that grows with the square of speed."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="quadratic_drag",
    kind="friction",
    group="added",
    law="f = coefficient |v| v",
    meaning="oil pushed through gaps, air under a bellows",
    source="Lord Rayleigh 1876; Worden & Tomlinson 2001, sec. 2.2.5",
    parameters=(Parameter("coefficient", "V/(m/s)2", 40.0, 20.0, 120.0, "drive voltage that overcomes it, per square of the speed"),),
)


@inlined
def force(coefficient: float, v: float) -> float:
    """Drag at speed ``v`` (m/s), V."""
    return coefficient * abs(v) * v
