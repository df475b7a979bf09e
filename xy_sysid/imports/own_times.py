"""Columns with times of their own --> columns of one clock: the output's. The input is held until its next value, as a drive does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.roles import Found, Roles
from xy_sysid.imports.sheet import Column
from xy_sysid.samples.block import FloatArray

SAME = 1e-9  # s; instants that differ by less are one


def on_one_clock(path: Path, roles: Roles, notes: list[str]) -> Roles:
    """The same roles with values at the instants of the first output, whose clock becomes the time; as they are where no output has a clock.

    Raises BadRecording for columns without a clock beside some with one, or that share no time.
    """
    sides = [column for _, side in roles.sides() for column in side.values()]
    base = next((column for column in roles.outputs.values() if column.clock is not None), None)
    if base is None or base.clock is None or roles.time is not None:
        return roles
    without = next((column for column in sides if column.clock is None), None)
    if without is not None:
        raise BadRecording(path, f"{base.name!r} has a time of its own and {without.name!r} has none", "Choose columns of one group with --map.")
    begin = max(float(column.clock[0]) for column in sides if column.clock is not None)
    end = min(float(column.clock[-1]) for column in sides if column.clock is not None)
    instants = base.clock[(base.clock >= begin - SAME) & (base.clock <= end + SAME)]
    if instants.size < 2:
        raise BadRecording(path, f"{', '.join(repr(column.name) for column in sides)} share no time", "Choose columns that were recorded together.")
    moved = [column.name for column in sides if not _same(column.clock, base.clock)]
    if moved:
        notes.append(
            f"{', '.join(map(repr, moved))} and {base.name!r} have times of their own: values are held until the next, at those of {base.name!r}"
        )

    def held(side: Found) -> Found:
        return {axis: _held(column, instants) for axis, column in side.items()}

    time = Column(f"time of {base.name}", "s", instants)
    return replace(roles, time=time, inputs=held(roles.inputs), outputs=held(roles.outputs), references=held(roles.references))


def _same(one: FloatArray | None, other: FloatArray) -> bool:
    return one is not None and one.shape == other.shape and bool(np.all(np.abs(one - other) < SAME))


def _held(column: Column, instants: FloatArray) -> Column:
    """The latest value at each of the instants."""
    assert column.clock is not None
    rows = np.searchsorted(column.clock, instants + SAME, side="right") - 1
    return replace(column, values=column.values[rows], clock=None)
