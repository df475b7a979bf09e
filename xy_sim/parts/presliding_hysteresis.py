"""Presliding hysteresis: before it slides, friction acts as a spring with hysteresis."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="presliding_hysteresis",
    kind="friction",
    group="effect",
    law="z' = v - |v| z / (length level(v) / coulomb); f = coulomb z / length + damping z'",
    meaning="asperities bend before they break away: micrometre hysteresis loops around each reversal. All dry friction goes through them",
    source="C. Canudas de Wit et al., A new model for control of systems with friction (LuGre), IEEE TAC 40 (1995), eq. 1-3",
    parameters=(
        Parameter("coulomb", "V", 0.25, 0.1, 0.4, "level when sliding", 1e-6, 100.0),
        Parameter("length", "m", 10e-6, 5e-6, 20e-6, "deflection at which the bristles slide", 1e-7, 1e-2),
        Parameter("damping", "V/(m/s)", 2.0, 1.0, 4.0, "damping of the bristles"),
    ),
    family="dry_friction",
)


@inlined
def rate(z: float, v: float, slide: float) -> float:
    """z', m/s; slide: steady deflection when sliding at this speed, m."""
    return v - abs(v) * z / slide


@inlined
def longest_step(v: float, slide: float) -> float:
    """Longest inner step that resolves the bristles at speed ``v``, s: a quarter of their relaxation time."""
    return 0.25 * slide / (abs(v) + 1e-9)
