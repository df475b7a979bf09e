"""Constant load: a force that does not change."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="constant_load",
    kind="force",
    group="effect",
    law="f = -load",
    meaning="a tilted axis, a hanging cable, a current offset of the amplifier",
    source="Newton; Gautier & Venture, EMPS benchmark 2013, 'offset'",
    parameters=(Parameter("load", "V", 0.15, 0.05, 0.4, "drive voltage that holds it", -100.0, 100.0, True),),
)


@inlined
def force(load: float) -> float:
    """Force on the table, V."""
    return -load
