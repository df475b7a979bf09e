"""How much of the error of an axis is explained, by one common rule."""

from __future__ import annotations

PARTLY = 0.7  # of the rigid model's excess, or of its held-out error, that may be left if effects are to count as a part of the truth


def nearer(first: tuple[float, float], last: tuple[float, float]) -> bool:
    """Whether effects brought the axis nearer to its floor; (excess, held-out error) of the rigid model and of the last one."""
    return any(now < PARTLY * before for before, now in zip(first, last, strict=True))
