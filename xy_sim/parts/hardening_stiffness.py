"""Hardening stiffness: a spring towards the middle that stiffens with distance."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="hardening_stiffness",
    kind="force",
    group="effect",
    law="f = -(linear q + cubic q^3)",
    meaning="bellows, cable chain, hose",
    source="G. Duffing 1918; Worden & Tomlinson, Nonlinearity in Structural Dynamics, 2001, sec. 2.2.1",
    parameters=(
        Parameter("cubic", "V/m3", 3000.0, 1500.0, 20000.0, "drive voltage that holds it, per cube of the distance", 0.0, 1e12),
        Parameter("linear", "V/m", 0.0, 0.0, 0.0, "the same, per distance", 0.0, 1e9),
    ),
)


@inlined
def force(cubic: float, linear: float, q: float) -> float:
    """Force on the table at ``q`` (m), V."""
    return -(linear + cubic * q * q) * q


@inlined
def energy(cubic: float, linear: float, q: float) -> float:
    """Potential at ``q`` (m), V m."""
    return (0.5 * linear + 0.25 * cubic * q * q) * q * q
