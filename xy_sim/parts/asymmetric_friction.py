"""Dry friction that differs between the two directions."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="asymmetric_friction",
    kind="friction",
    group="effect",
    law="f = coulomb (1 + asymmetry sign(v)) sign(v)",
    meaning="worn or tilted nut, one-sided wiper: more friction forth than back",
    source="Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991, ch. 3",
    parameters=(
        Parameter("asymmetry", "", 0.5, 0.3, 0.9, "relative difference of each direction from the mean; positive: larger forth", -1.0, 1.0, True),
        Parameter("coulomb", "V", 0.2, 0.1, 0.3, "mean level", 0.0, 100.0),
    ),
    family="dry_friction",
)


@inlined
def level(asymmetry: float, coulomb: float, direction: float) -> float:
    """Size of the friction in ``direction`` (+1 or -1), V."""
    return coulomb * (1.0 + asymmetry * direction)
