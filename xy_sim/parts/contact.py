"""Two bodies that touch: the law that end stops, backlash and loose joints share.

Law: f = k d (1 + c d'), never pulling; d is how far they press into one another.
Source: K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975).
"""

from __future__ import annotations

from xy_sim.inlined import inlined


@inlined
def force(x: float, v: float, half_gap: float, stiffness: float, damping: float) -> float:
    """Force in the direction of ``x`` that a body at ``x`` (m), moving at ``v`` (m/s), exerts on what lies beyond +-half_gap, N."""
    if x > half_gap:
        return max(stiffness * (x - half_gap) * (1.0 + damping * v), 0.0)
    if x < -half_gap:
        return min(stiffness * (x + half_gap) * (1.0 - damping * v), 0.0)
    return 0.0


@inlined
def regime(x: float, v: float, half_gap: float, damping: float) -> int:
    """Which branch of the law holds: 0 free, 1 and 2 pressing on either side, 3 and 4 parting too fast to press."""
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
