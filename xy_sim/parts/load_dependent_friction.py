"""Friction of a gear that grows with the effort through it."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="load_dependent_friction",
    kind="friction",
    group="added",
    drawn=False,
    law="f = share |u| sign(v), where u is the voltage of the drive; at rest it holds up to share |u|",
    meaning="gear, worm or harmonic drive: its teeth have more friction the more they transmit",
    source="Duclusaud, Passault, Padois & Ly, Extended friction models, arXiv:2410.08650, 2024; switching as for Coulomb friction",
    parameters=(Parameter("share", "", 0.15, 0.08, 0.3, "friction as a fraction of the drive voltage", 0.0, 0.9),),
)


@inlined
def level(share: float, volts: float) -> float:
    """Size of the friction while the drive applies ``volts`` (V), V."""
    return share * abs(volts)
