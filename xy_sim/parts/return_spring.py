"""Return spring: a spring towards a rest position, which may soften."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="return_spring",
    kind="force",
    group="effect",
    law="f = -stiffness (d - softening d^3), d = q - rest",
    meaning="the return spring of a valve or throttle, a flexure, a rubber bush",
    source="Kovacic & Brennan, The Duffing Equation, 2011, sec. 1.2",
    parameters=(
        Parameter("stiffness", "V/m", 10.0, 5.0, 40.0, "drive voltage that holds it, per distance", 0.0, 1e7),
        Parameter("rest", "m", 0.0, -0.02, 0.02, "rest position of the spring", -1e4, 1e4),
        Parameter("softening", "1/m2", 0.0, 0.0, 10.0, "relative loss of stiffness per square of the distance", -1e6, 1e6),
    ),
    family="spring",
    drawn=False,
)


@inlined
def force(stiffness: float, rest: float, softening: float, q: float) -> float:
    """Force on the table at ``q`` (m), V."""
    d = q - rest
    return stiffness * (softening * d * d * d - d)


@inlined
def energy(stiffness: float, rest: float, softening: float, q: float) -> float:
    """Potential at ``q`` (m) above that at 0, V m."""
    far, near = (q - rest) * (q - rest), rest * rest
    return 0.5 * stiffness * (far - near) * (1.0 - 0.5 * softening * (far + near))


@inlined
def slope(stiffness: float, rest: float, softening: float) -> float:
    """Force per distance at the encoder's zero, V/m."""
    return stiffness * (1.0 - 3.0 * softening * rest * rest)
