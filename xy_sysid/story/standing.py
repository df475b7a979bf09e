"""How much of the error of an axis is explained, by one common rule."""

from __future__ import annotations

PARTLY = 0.7  # largest remaining fraction of the rigid model's excess, or held-out error, for effects to count as a partial explanation


def nearer(first: tuple[float, float], last: tuple[float, float]) -> bool:
    """True if effects brought the axis closer to its floor; (excess, held-out error) of the rigid model and of the last one."""
    return any(now < PARTLY * before for before, now in zip(first, last, strict=True))
