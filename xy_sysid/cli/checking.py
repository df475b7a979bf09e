"""A saved model of either kind in frequency: its response against the measured one, line by line in sigma."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xy_sysid.model_check import ModelCheck
    from xy_sysid.recording import Recording
    from xy_sysid.saved_models import Saved


def longest(recording: Recording, axis: str) -> Any:
    """Input and output of the longest gap-free run."""
    run = max(recording.runs(), key=lambda part: part.stop - part.start)
    u, y = recording.axis(axis)
    return u[run], y[run]


def checked(recording: Recording, axis: str, saved: Saved, settings: Any, samples: int | None = 0) -> tuple[ModelCheck, tuple[str, ...]]:
    """The check and the notes of the estimate; samples: of a period, see ``offline.estimate``. Raises BadInput."""
    from xy_sysid.model_check import check, check_motion
    from xy_sysid.offline import estimate, judged

    found = estimate(recording, axis, settings, samples)
    judged(found.frf)
    u, y = longest(recording, axis)
    if saved.axis is None:
        return check(saved.tf, found.frf, u, y, saved.hold), found.notes
    moved = estimate(simulated(recording, axis, saved), axis, settings, samples)
    return check_motion(saved.velocity(recording.sampling_rate, u, y), moved.frf, found.frf, y), (
        *found.notes,
        *([saved.doubt] if saved.doubt else []),
    )


def simulated(recording: Recording, axis: str, saved: Saved) -> Recording:
    """The recording as the model says that this axis would have moved in it, run by run."""
    u, y = recording.axis(axis)
    position = recording.position.copy()
    column = recording.axes.index(axis)
    for run in recording.runs():
        if run.stop - run.start > 1:
            moved = np.cumsum(saved.velocity(recording.sampling_rate, u[run], y[run])) / recording.sampling_rate
            position[run.start + 1 : run.stop, column] = y[run.start] + moved
    return replace(recording, position=position)
