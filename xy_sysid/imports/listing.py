"""The content of a file before it is read as a recording: columns, topics or arrays, and the possible role of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from xy_sysid.bags.cdr import ARRAY_TYPE, JOINT_TYPE, Unreadable, array_layout, joint_layout
from xy_sysid.bags.reading import Bag
from xy_sysid.errors import XySysidError
from xy_sysid.imports import arrays, format_of, load, response_file, roles, sheet_of
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.registry import BAG
from xy_sysid.imports.sheet import Column, Sheet
from xy_sysid.samples.block import FloatArray

FEW = 8  # distinct levels that are counted
LARGE = 300_000_000  # bytes; a larger bag is listed without being read


@dataclass(frozen=True, slots=True)
class Listed:
    """One column. looks: description of its numbers; role: its role without --map, "" for none."""

    name: str
    unit: str
    rows: int
    first: float | str | None
    low: float | None
    high: float | None
    looks: str
    role: str


@dataclass(frozen=True, slots=True)
class Listing:
    """kind: of ``registry.FORMATS``, or bag; reads: the recording without options; problem: why there is none; notes: of that reading."""

    kind: str
    columns: tuple[Listed, ...]
    reads: str
    problem: str
    notes: tuple[str, ...]


def listing(path: Path) -> Listing:
    """The content of a file. Raises BadRecording if it cannot be opened at all."""
    form = format_of(path)
    kind = form.kind
    if form is BAG:
        found = _topics(path)
        if sum(file.stat().st_size for file in (path.iterdir() if path.is_dir() else [path]) if file.is_file()) > LARGE:
            return Listing(kind=kind, columns=found, reads="large: not read", problem="", notes=())
    else:
        sheet = sheet_of(path, form)
        taken = _taken(sheet)
        found = tuple(_listed(column, taken.get(column.name, "")) for column in sheet.columns)
        if form.kind == "response":
            return _of_response(path, sheet)
    try:
        recording = load(path)
    except XySysidError as problem:
        return Listing(kind=kind, columns=found, reads="", problem=str(problem), notes=())
    reads = (
        f"axes {', '.join(recording.axes)}, {len(recording)} samples, {recording.sampling_rate:.6g} Hz, {recording.duration:.4g} s, "
        f"input in {recording.input_unit}, output in {recording.output_unit}"
    )
    return Listing(
        kind=kind,
        columns=found,
        reads=reads if recording.measured == "position" else f"{reads} (from its {recording.measured})",
        problem="",
        notes=recording.notes,
    )


def _of_response(path: Path, sheet: Sheet) -> Listing:
    """The listing of a measured frequency response."""
    roles_of = {column.name: role for role in response_file.NAMES if (column := response_file.column_of(sheet, role, Reading())) is not None}
    found = tuple(_listed(column, roles_of.get(column.name, "")) for column in sheet.columns)
    try:
        measured = response_file.responses(path, sheet, Reading())
    except XySysidError as problem:
        return Listing(kind="response", columns=found, reads="", problem=str(problem), notes=())
    said = [f"axis {name}, {len(one)} lines from {one.frequency[0]:.4g} to {one.frequency[-1]:.4g} Hz" for name, one in measured.items()]
    notes = tuple(dict.fromkeys(note for one in measured.values() for note in one.origin.notes))
    return Listing(kind="response", columns=found, reads=f"a measured frequency response: {'; '.join(said)}", problem="", notes=notes)


def _taken(sheet: Sheet) -> Mapping[str, str]:
    """Role of each column without --map."""
    contract = [(arrays.INPUTS, "input"), (arrays.OUTPUTS, "output"), (arrays.REFERENCES, "reference"), (arrays.TIMES, "time")]
    if sheet.arrays is not None:
        found = {column.name: role for column in sheet.columns for names, role in contract if column.name.partition(":")[0] in names}
        if {"input", "output"} <= set(found.values()):
            return found
    try:
        known = roles.assigned(sheet, Reading(), [])
    except XySysidError:
        return {}
    said = {column.name: f"{axis}.{role}" for role, columns in known.sides() for axis, column in columns.items()}
    return said | {column.name: role for role, column in (("time", known.time), ("seq", known.seq), ("joint", known.joint)) if column is not None}


def _listed(column: Column, role: str) -> Listed:
    if column.words:
        return _row(column, column.words[0], "words", role)
    values = column.values
    finite = values[np.isfinite(values)]
    if not finite.size:
        return _row(column, None, "no numbers", role)
    row = _row(column, float(finite[0]), _looks(column, finite), role)
    return replace(row, low=float(finite.min()), high=float(finite.max()))


def _row(column: Column, first: float | str | None, looks: str, role: str) -> Listed:
    rows = len(column.words) or len(column.values)
    return Listed(name=column.name, unit=column.unit, rows=rows, first=first, low=None, high=None, looks=looks, role=role)


def _looks(column: Column, finite: FloatArray) -> str:
    missing = f", {len(column.values) - len(finite)} missing" if len(finite) < len(column.values) else ""
    if column.step:
        return f"a clock: even steps of {column.step:.6g}{missing}"
    if len(finite) > 2:
        steps = np.diff(finite)
        if float(steps.min()) > 0:
            return f"a clock: steps of {steps.min():.4g} to {steps.max():.4g}{missing}"
    levels = len(np.unique(finite[:100_000]))
    return ("constant" if levels == 1 else f"{levels} levels" if levels <= FEW else "") + missing if levels <= FEW else missing.removeprefix(", ")


def _topics(path: Path) -> tuple[Listed, ...]:
    """A row for each topic, with the names of its columns or joints."""
    with Bag(path) as bag:
        names = [topic.name for topic in bag.topics]
        inside: dict[str, str] = {}
        counts = dict.fromkeys(names, 0)
        for batch, _ in bag.batches(names):
            for place, number in zip(*np.unique(batch.topic, return_index=True), strict=True):
                name = names[int(place)]
                parse = {ARRAY_TYPE: array_layout, JOINT_TYPE: joint_layout}.get(bag.kind(name) or "")
                if parse is not None and name not in inside:
                    start, length = int(batch.start[number]), int(batch.length[number])
                    try:
                        layout = parse(batch.buffer[start : start + length].tobytes())
                    except Unreadable:
                        continue
                    inside[name] = layout.names[1] if parse is array_layout and len(layout.names) == 2 else ", ".join(layout.names)
            for place, count in enumerate(np.bincount(batch.topic, minlength=len(names)).tolist()):
                counts[names[place]] += count
        kinds = {topic.name: topic.kind.rsplit("/", 1)[-1] for topic in bag.topics}
        return tuple(
            Listed(name=name, unit=kind, rows=counts[name], first=inside.get(name), low=None, high=None, looks="messages", role="")
            for name, kind in kinds.items()
        )
