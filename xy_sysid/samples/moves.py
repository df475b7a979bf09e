"""Detects a single move in one direction, from rest to rest: too little to distinguish friction, load and inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run

RESTS = 0.05  # of the highest speed; slower is rest, or the end of a move
BACK = 0.02  # of the distance; a smaller reverse motion is overshoot
ONE_MOVE = "the axis makes one move in one direction, from rest to rest"


def one_move(position: FloatArray) -> bool:
    """True if a position (n,) makes a single move."""
    steps = np.diff(position)
    fastest = float(np.max(np.abs(steps), initial=0.0))
    moving = np.flatnonzero(np.abs(steps) > RESTS * fastest)
    if fastest == 0.0 or moving[0] == 0 or moving[-1] == len(steps) - 1:
        return False
    forth, back = float(steps[steps > 0].sum()), float(-steps[steps < 0].sum())
    return min(forth, back) < BACK * max(forth, back) and bool(np.all(np.diff(moving) == 1))


def several_moves(runs: Sequence[Run]) -> None:
    """Raises BadInput if the runs contain only one move."""
    if len(runs) == 1 and one_move(runs[0].position):
        act = "It cannot be analysed: record several moves in both directions, better 60 s of noise."
        raise BadInput(f"motion of axis {runs[0].axis}", "one move in one direction, from rest to rest", "several moves in both directions", act)
