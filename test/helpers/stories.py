"""The story of one simulated axis, told once."""

from __future__ import annotations

from functools import cache

from helpers.simulated import recorded
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.story.story import Story, tell

RATE = 2000.0


@cache
def data() -> tuple[FloatArray, FloatArray]:
    u, y = recorded("x:coulomb_friction", seconds=20.0).axis("x")
    return u, y


@cache
def told() -> Story:
    return tell(Run("x", RATE, *data()))
