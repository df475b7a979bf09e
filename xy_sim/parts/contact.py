"""Contact of two bodies: the law of end stops, backlash and loose masses.

Law: f = k d (1 + c d'), but never below 0; d is the depth of indentation.
Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975).
"""

from __future__ import annotations

from xy_sim.inlined import inlined


@inlined
def force(x: float, v: float, half_gap: float, stiffness: float, damping: float) -> float:
    """Force in the direction of ``x`` that a body at ``x`` (m), moving at ``v`` (m/s), exerts on a stop at +-half_gap, N."""
    if x > half_gap:
        return max(stiffness * (x - half_gap) * (1.0 + damping * v), 0.0)
    if x < -half_gap:
        return min(stiffness * (x + half_gap) * (1.0 - damping * v), 0.0)
    return 0.0


@inlined
def regime(x: float, v: float, half_gap: float, damping: float) -> int:
    """The branch of the law: 0 free, 1 and 2 in contact on either side, 3 and 4 separating too fast for a force."""
    if x > half_gap:
        return 1 if 1.0 + damping * v > 0.0 else 3
    if x < -half_gap:
        return 2 if 1.0 - damping * v > 0.0 else 4
    return 0


@inlined
def energy(x: float, half_gap: float, stiffness: float) -> float:
    """Elastic energy of the contact, J."""
    depth = max(abs(x) - half_gap, 0.0)
    return 0.5 * stiffness * depth * depth
