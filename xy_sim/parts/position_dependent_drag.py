"""Viscous drag that changes along the travel."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="position_dependent_drag",
    kind="drive",
    group="effect",
    law="f = factor(q) drag v; factor = 1 + slope q, never below 0",
    meaning="a guide or screw that is not straight or parallel, preload that grows towards one end",
    source="Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), sec. 2",
    parameters=(Parameter("slope", "1/m", 3.0, 1.0, 6.0, "relative change of the drag per distance along the travel", -1e4, 1e4, signed=True),),
    drawn=False,
)


@inlined
def factor(slope: float, q: float) -> float:
    """Drag at ``q`` (m) over that at 0."""
    return max(1.0 + slope * q, 0.0)
