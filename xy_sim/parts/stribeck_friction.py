"""Stribeck friction: dry friction that falls with speed from its breakaway level."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="stribeck_friction",
    kind="friction",
    group="effect",
    law="f = (coulomb + excess exp(-(v / velocity)^2)) sign(v); at rest it holds up to coulomb + excess",
    meaning="boundary lubrication breaks down as the film builds up: stick-slip at crawling speed",
    source="R. Stribeck 1902; Gaussian form of Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), eq. 6",
    parameters=(
        Parameter("excess", "V", 0.2, 0.08, 0.4, "breakaway above the Coulomb level", 0.0, 100.0),
        Parameter("coulomb", "V", 0.15, 0.05, 0.25, "level at speed", 0.0, 100.0),
        Parameter("velocity", "m/s", 0.01, 0.005, 0.02, "speed at which the excess has fallen to 1/e", 1e-6, 10.0),
    ),
    family="dry_friction",
)


@inlined
def level(excess: float, coulomb: float, velocity: float, v: float) -> float:
    """Size of the friction at speed ``v`` (m/s), V."""
    if excess == 0.0:
        return coulomb
    ratio = v / velocity
    return coulomb + excess * math.exp(-ratio * ratio)
