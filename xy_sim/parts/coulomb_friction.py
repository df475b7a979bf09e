"""Coulomb friction: dry friction of constant magnitude."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="coulomb_friction",
    kind="friction",
    group="effect",
    law="f = coulomb sign(v); at rest it holds up to coulomb",
    meaning="preloaded nut, guide seals, bearings",
    source="C. A. Coulomb 1785; switching after Olsson et al. 1998, sec. 2; here each zero of v is located in time",
    parameters=(Parameter("coulomb", "V", 0.2, 0.05, 0.4, "drive voltage that overcomes it, moving or at rest", 0.0, 100.0),),
    family="dry_friction",
)


@inlined
def level(coulomb: float) -> float:
    """Size of the friction, V."""
    return coulomb
