"""The story of one simulated axis, computed once."""

from __future__ import annotations

from functools import cache

from helpers.simulated import recorded
from xy_sysid.axis.model import STANDARD
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.story.acts import Job, perform
from xy_sysid.story.story import Story, tell

RATE = 2000.0


@cache
def data() -> tuple[FloatArray, FloatArray]:
    u, y = recorded("x:coulomb_friction", seconds=20.0).axis("x")
    return u, y


@cache
def told() -> Story:
    return tell(Run("x", RATE, *data()))


def with_effects(story: Story, run: Run, *effects: str) -> Story:
    """A story whose model gets exactly these effects, as requested by the nodes."""
    job = Job(act="effects", run=run, story=story, effects=effects, tolerance=story.tolerance)
    return [made for _, made in perform(job, STANDARD) if made is not None][-1]
