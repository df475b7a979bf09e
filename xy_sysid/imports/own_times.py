"""Columns with their own times --> columns on one clock, that of the first output.

A column has its own time if the file says so, or if its numbers are in separate rows. The input is held until its next value, as a
drive does: a faster input is averaged from each instant to the next, of a slower one the latest value is used. Outputs and references
are interpolated.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.even import between
from xy_sysid.imports.paired_streams import HOLLOW
from xy_sysid.imports.roles import Found, Roles
from xy_sysid.imports.sheet import Column
from xy_sysid.samples.block import FloatArray

SAME = 1e-9  # s; instants that differ by less are equal
APART = 0.1  # of the rows with a first output; if more lack an input or another output, each column has its own time


def clocked(roles: Roles) -> bool:
    """Whether columns have their own times, and no column was chosen as the time."""
    return roles.time is None and any(column.clock is not None for column in roles.outputs.values())


def with_own_times(roles: Roles, time: FloatArray, notes: list[str]) -> Roles:
    """The roles with the instants of each column, if columns have numbers in separate rows; otherwise unchanged. time: (n,) s of all rows."""
    sides = [column for _, side in roles.sides() for column in side.values()]
    back = bool(np.any(np.diff(time[np.isfinite(time)]) < 0))
    if not roles.outputs or back or any(len(column.values) != len(time) or column.starts or column.words for column in sides):
        return roles
    there = {column.name: np.isfinite(column.values) & np.isfinite(time) for column in sides}
    first = max(roles.outputs.values(), key=lambda column: int(np.sum(there[column.name])))
    rows = there[first.name]
    axes = [axis for axis, column in roles.outputs.items() if np.sum(there[column.name]) > (1.0 - HOLLOW) * np.sum(rows)]
    used = [side[axis] for side in (roles.inputs, roles.outputs) for axis in axes]
    if all(np.sum(rows & ~there[column.name]) <= APART * np.sum(rows) for column in used) or any(np.sum(there[column.name]) < 2 for column in used):
        return roles

    def own(side: Found) -> Found:
        return {axis: replace(column, values=column.values[there[column.name]], clock=time[there[column.name]]) for axis, column in side.items()}

    if len(axes) < len(roles.outputs):
        notes.append(f"axis {', '.join(axis for axis in roles.outputs if axis not in axes)} has hardly any numbers; it is left out")
    kept = roles.of(axes)
    return replace(kept, time=None, inputs=own(kept.inputs), outputs=own(kept.outputs), references=own(kept.references))


def on_one_clock(path: Path, roles: Roles, notes: list[str]) -> tuple[Roles, Column]:
    """The roles with values at the instants of the first output, and this time, s.

    Raises BadRecording if only some columns have a clock, or if they share no time.
    """
    sides = [column for _, side in roles.sides() for column in side.values()]
    base = next(column for column in roles.outputs.values() if column.clock is not None)
    without = next((column for column in sides if column.clock is None), None)
    if base.clock is None or without is not None:
        problem = f"{base.name!r} has a time of its own and {without.name if without else ''!r} has none"
        raise BadRecording(path, problem, "Choose columns of one group with --map.")
    begin = max(float(column.clock[0]) for column in sides if column.clock is not None)
    end = min(float(column.clock[-1]) for column in sides if column.clock is not None)
    instants = base.clock[(base.clock >= begin - SAME) & (base.clock <= end + SAME)]
    if instants.size < 2:
        raise BadRecording(path, f"{', '.join(repr(column.name) for column in sides)} share no time", "Choose columns that were recorded together.")
    moved = [column.name for column in sides if not _same(column.clock, base.clock)]
    if moved:
        notes.append(
            f"{', '.join(map(repr, moved))} and {base.name!r} have separate times: they are sampled at those of {base.name!r}; an input has "
            "the mean of its values until the next time, or its latest value, and outputs are interpolated"
        )
    inputs = {axis: _held(column, instants) for axis, column in roles.inputs.items()}
    outputs, references = (_moving(side, instants) for side in (roles.outputs, roles.references))
    return replace(roles, inputs=inputs, outputs=outputs, references=references), Column(f"time of {base.name}", "s", instants)


def _same(one: FloatArray | None, other: FloatArray) -> bool:
    return one is not None and one.shape == other.shape and bool(np.all(np.abs(one - other) < SAME))


def _held(column: Column, instants: FloatArray) -> Column:
    """The mean of the values from each instant to the next, or the latest value if there is none."""
    assert column.clock is not None
    rows = np.searchsorted(column.clock, instants + SAME, side="right") - 1
    sums = np.add.reduceat(column.values[: rows[-1] + 1], rows)
    return replace(column, values=sums / np.maximum(np.diff(rows, append=rows[-1] + 1), 1), clock=None)


def _moving(side: Found, instants: FloatArray) -> Found:
    """Each column at the instants: its own value if it has one there, otherwise interpolated."""
    found: Found = {}
    for axis, column in side.items():
        assert column.clock is not None
        rows = np.clip(np.searchsorted(column.clock, instants - SAME), 0, len(column.clock) - 1)
        exact = np.abs(column.clock[rows] - instants) < SAME
        values = column.values[rows]
        if not exact.all():
            values = np.where(exact, values, _between(column.clock, column.values, instants))
        found[axis] = replace(column, values=values, clock=None)
    return found


def _between(clock: FloatArray, values: FloatArray, instants: FloatArray) -> FloatArray:
    """Values (n,) at other instants; of two values at one instant the first is used."""
    here = np.isfinite(values) & np.isfinite(clock)
    here[here] = np.diff(clock[here], prepend=-np.inf) > 0
    return between(clock[here], values[here], instants)
