"""A sheet with roles --> Table: instants in seconds, values in SI, a column for each joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import instants
from xy_sysid.imports.foreign_units import COUNTS, DRIVES, MOTIONS, Unit, to_si, unit_of
from xy_sysid.imports.names import meaning, unit_at_end, usual_unit
from xy_sysid.imports.own_times import clocked, on_one_clock, with_own_times
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.roles import Found, Roles, assigned
from xy_sysid.imports.sheet import Column, Sheet, spoken
from xy_sysid.imports.table import ONE_UNIT, Table, as_they_stand, places_of
from xy_sysid.samples.block import FloatArray

MEASURED = {"measured", "meas", "actual", "act", "feedback", "fb", "ist"}  # words of an input that was read, not commanded
JOINTS = 64  # most joints; more names are something else


def table(sheet: Sheet, reading: Reading, notes: list[str]) -> Table:
    """The table of a sheet. Raises BadRecording, which names the existing columns."""
    notes += sheet.notes
    roles = assigned(sheet, reading, notes)
    if roles.joint is not None:
        roles = _by_joint(sheet, roles, notes)
    every = tuple(axis for axis in roles.inputs if axis in roles.outputs)
    roles = roles.of([every[place] for place in places_of(every, reading.axes)])  # axes that are left out need not be readable
    roles, time, fs = _in_time(sheet, roles, reading, notes)
    axes = tuple(roles.outputs)
    u, input_unit = _values(sheet, "input", roles.inputs, axes, reading, notes)
    y, output_unit = _values(sheet, "output", roles.outputs, axes, reading, notes)
    reference = None
    if axes and all(axis in roles.references for axis in axes):
        r, unit = _values(sheet, "reference", roles.references, axes, reading, [])
        reference = r if same_unit(reading, unit, output_unit, notes) else None
    read = [column.name for axis, column in roles.inputs.items() if axis in axes and MEASURED & set(spoken(column.name))]
    if read:
        notes.append(f"the input {', '.join(map(repr, read))} was measured, so it is probably not held between samples: fit it with --set hold=none")
    if roles.guessed:
        notes.append(_taken(roles, axes, {"input": input_unit, "output": output_unit}))
    return Table(
        axes=axes,
        time=time,
        fs=fs,
        seq=None if roles.seq is None or reading.rate is not None else roles.seq.values,
        input=u,
        output=y,
        reference=reference,
        input_unit=input_unit.name,
        output_unit=output_unit.name,
        measured=output_unit.quantity if output_unit.quantity in MOTIONS else "position",
        starts=_starts(sheet.path, roles, axes),
    )


def _starts(path: Path, roles: Roles, axes: tuple[str, ...]) -> tuple[int, ...]:
    """First rows of stretches, the same in all columns. Raises BadRecording if they differ."""
    columns = [side[axis] for _, side in roles.sides() for axis in axes if axis in side]
    for column in columns[1:]:
        if column.starts != columns[0].starts:
            problem = f"the stretches of {columns[0].name!r} and {column.name!r} begin at different rows"
            raise BadRecording(path, problem, "Choose columns of the same stretches with --map.")
    return columns[0].starts if columns else ()


def same_unit(reading: Reading, unit: Unit, output: Unit, notes: list[str]) -> bool:
    """Whether a reference has the unit of the output; if not, a note says that it is left out. Raises BadInput if its unit was given."""
    if unit.name == output.name:
        return True
    given = next((f"{what}={text}" for what, text in reading.units.items() if what.endswith("reference")), "")
    if given:
        raise BadInput("--unit", given, f"a unit of the output's quantity, which is in {output.name}", "Give the reference in such a unit.")
    notes.append(f"the reference is in {unit.name} and the output in {output.name}: the reference is left out")
    return False


def _in_time(sheet: Sheet, roles: Roles, reading: Reading, notes: list[str]) -> tuple[Roles, FloatArray | None, float | None]:
    """The roles with a value of each column at every instant, and the instants, s, or None with the rate, Hz."""
    if clocked(roles):
        roles, clock = on_one_clock(sheet.path, roles, notes)
        if reading.rate is None:
            return replace(roles, time=clock), clock.values, sheet.fs
        notes += as_they_stand(reading.rate, clock.name)
        return roles, None, reading.rate
    time, fs = _time(sheet, roles, reading, notes)
    own = roles if time is None or roles.seq is not None else with_own_times(roles, time, notes)
    if own is roles:
        return roles, time, fs
    moved, clock = on_one_clock(sheet.path, own, notes)
    return replace(moved, time=roles.time), clock.values, fs


def _time(sheet: Sheet, roles: Roles, reading: Reading, notes: list[str]) -> tuple[FloatArray | None, float | None]:
    """Instants, s, or None with the rate, Hz."""
    if reading.rate is not None:
        notes += as_they_stand(reading.rate, None if roles.time is None else roles.time.name)
        return None, reading.rate
    if roles.time is None:
        if sheet.fs is None and roles.seq is None:
            raise BadRecording(sheet.path, f"no time {sheet.kind}; {sheet.names()}", "Name it with --map time=..., or give --rate in Hz.")
        notes += as_they_stand(sheet.fs, None)
        return None, sheet.fs
    return instants.stamps(sheet.path, roles.time, reading, notes).seconds(), sheet.fs


def _values(sheet: Sheet, role: str, columns: Found, axes: tuple[str, ...], reading: Reading, notes: list[str]) -> tuple[FloatArray, Unit]:
    """(n, axes) in SI, and the unit that they share."""
    found: list[FloatArray] = []
    units: dict[str, Unit] = {}
    texts: set[str] = set()
    said: list[str] = []
    for axis in axes:
        column = columns[axis]
        if column.words:
            raise BadRecording(sheet.path, f"the {sheet.kind} {column.name!r} holds words ({column.words[0][:20]!r})", "Choose one of numbers.")
        text = reading.unit(role, axis) or column.unit or _usual(column, role)
        known = meaning(column.name, "")
        if role == "output" and known is not None and known.quantity in MOTIONS[1:] and unit_of(text).quantity == "unknown":
            problem = f"the unit {text!r} of the {known.quantity} {column.name!r} is not known"
            raise BadRecording(sheet.path, problem, "Give one that is, for example --unit output=rpm.")
        scale = reading.scale(role, axis)
        told: list[str] = []
        values, text = scaled(column.values, text, scale, f"the {role} of {axis}", told)
        values, unit = to_si(values, text, f"the {role}", told)
        found.append(values)
        units[axis] = unit
        texts.add(text)
        said += told
    if len({unit.name for unit in units.values()}) > 1:
        given = ", ".join(sorted(texts))
        raise BadRecording(sheet.path, f"axes in different units ({given})", ONE_UNIT)
    if len({len(one) for one in found}) > 1:
        lengths = ", ".join(f"{columns[axis].name} {len(one)}" for axis, one in zip(axes, found, strict=True))
        raise BadRecording(sheet.path, f"lengths differ: {lengths}", "Give one row per sample.")
    notes += dict.fromkeys(said)
    return np.column_stack(found), units[axes[0]]


def scaled(values: FloatArray, text: str, scale: float | None, what: str, notes: list[str]) -> tuple[FloatArray, str]:
    """Values times a factor, and their new unit: counts and unknown units become SI."""
    if scale is None:
        return values, text
    unit = unit_of(text)
    after = unit.name.replace(COUNTS, "m") if unit.quantity != "unknown" else "V" if " input" in f" {what}" else "m"
    if unit.quantity == "unknown" or unit.name.startswith(COUNTS):
        notes.append(f"{what}: {text} times {scale:g} is in {after}")
        text = after
    else:
        notes.append(f"{what} is multiplied by {scale:g}")
    return values * scale, text


def _usual(column: Column, role: str) -> str:
    known = meaning(column.name, "")
    if known is None or known.role not in (role, "reference"):
        return unit_at_end(column.name, DRIVES if role == "input" else MOTIONS) or ("V" if role == "input" else "m")
    if known.unit:
        return known.unit
    return usual_unit(column.name, known) if known.role == role else "m"


def _taken(roles: Roles, axes: tuple[str, ...], units: Mapping[str, Unit]) -> str:
    """A note on the guessed roles, for the user to check."""
    said = [] if roles.time is None else [f"time = {roles.time.name!r}"]
    for axis in axes:
        for role, columns in roles.sides():
            if axis in columns:
                said.append(f"{axis}.{role} = {columns[axis].name!r}" + (f" in {units[role].name}" if role in units else ""))
    return f"by their names: {', '.join(said)} (choose others with --map and --unit)"


def _by_joint(sheet: Sheet, roles: Roles, notes: list[str]) -> Roles:
    """A row for each joint at each instant --> a column for each joint, NaN where a joint has no row."""
    joint, time = roles.joint, roles.time
    assert joint is not None
    words = np.array(joint.words or [f"{value:g}" for value in joint.values.tolist()])
    names = list(dict.fromkeys(words.tolist()))
    if len(names) > JOINTS:
        raise BadRecording(
            sheet.path, f"the {sheet.kind} {joint.name!r} names {len(names)} joints", "Choose the column of joint names with --map joint=..."
        )
    rows = {name: np.flatnonzero(words == name) for name in names}
    instants = None if time is None else np.unique(time.values[np.isfinite(time.values)])
    longest = max(len(found) for found in rows.values())

    def spread(column: Column, name: str) -> Column:
        here = rows[name]
        if instants is None or time is None:
            place, size = np.arange(len(here)), longest
        else:
            here = here[np.isfinite(time.values[here])]
            place, size = np.searchsorted(instants, time.values[here]), len(instants)
        values = np.full(size, np.nan)
        values[place[::-1]] = column.values[here[::-1]]  # of two samples of one instant the first is kept
        return replace(column, name=f"{name} {column.name}", values=values, unit=column.unit)

    def all_joints(columns: Found) -> Found:
        return {name: spread(next(iter(columns.values())), name) for name in names} if columns else {}

    if len(roles.inputs) > 1:
        raise BadInput("--map", "several axes beside a column of joint names", "input=, output= without an axis", "Name one column for all joints.")
    notes.append(f"a row for each joint: {', '.join(names)} become the axes")
    inputs, outputs, references = (all_joints(columns) for columns in (roles.inputs, roles.outputs, roles.references))
    clock = None if instants is None or time is None else replace(time, values=instants)
    return replace(roles, time=clock, seq=None, inputs=inputs, outputs=outputs, references=references)
