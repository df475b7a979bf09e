"""Viscous friction: drag of grease and seals, proportional to speed."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="viscous_friction",
    kind="friction",
    group="base",
    law="f = coefficient v",
    meaning="drag in addition to that of the drive (velocity_gain and pole)",
    source="Olsson et al., Friction models and friction compensation, Eur. J. Control 4 (1998), eq. 2",
    parameters=(Parameter("coefficient", "V/(m/s)", 2.0, 0.5, 4.0, "drive voltage that overcomes the drag, per speed"),),
)


@inlined
def force(coefficient: float, v: float) -> float:
    """Drag at speed ``v`` (m/s), V."""
    return coefficient * v
