"""CSV: a first row that names ``time,x_voltage,x_position,...`` with the unit where it is not SI; then numbers.

A unit stands in brackets: ``x_position[mm]`` or ``x_position (mm)``. One axis may be called ``voltage,position``.
Columns are separated by comma, semicolon or tab; with the last two the decimal sign may be a comma.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NoReturn

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.table import Table
from xy_sysid.imports.units import to_si
from xy_sysid.recording import Recording, rate_from_time
from xy_sysid.stream import FloatArray

HEADER = re.compile(r"^\s*(?P<name>[^\[\(]*?)\s*(?:[\[\(]\s*(?P<unit>[^\]\)]*?)\s*[\]\)])?\s*$")
TIMES, NUMBERS = ("time", "t"), ("seq",)
INPUTS, OUTPUTS, REFERENCES = ("voltage", "u", "input"), ("position", "y", "output"), ("reference", "r")
MISSING = ("", "nan", "na", "n/a", "null", "none", "-")
EXAMPLE = "Name the columns like time,x_voltage,x_position[mm] in the first row."


def read(path: Path, input_key: str | None, output_key: str | None, notes: list[str]) -> Table:
    """The columns of a file; input_key, output_key: how the columns are called instead of voltage and position.

    Raises BadRecording that names the row for anything that is not a number.
    """
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise BadRecording(path, "not a text file", "Save it as CSV in UTF-8.") from None
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.lstrip().startswith("#")]
    if not rows:
        raise BadRecording(path, "the file holds no rows", EXAMPLE)
    head = rows[0][1]
    separator = max(";\t,", key=head.count) if any(sign in head for sign in ";\t,") else ","
    names, units = _header(path, head.split(separator))
    table = _numbers(path, rows[1:], separator, names)
    return _table(path, names, units, table, input_key, output_key, notes)


def _header(path: Path, cells: list[str]) -> tuple[list[str], list[str]]:
    names, units = [], []
    for cell in cells:
        found = HEADER.match(cell.strip().strip('"'))
        if found is None:
            raise BadRecording(path, f"row 1: column name {cell!r} is not understood", EXAMPLE)
        names.append(found["name"].strip())
        units.append(found["unit"] or "")
    while len(names) > 1 and not names[-1]:
        names.pop(), units.pop()
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise BadRecording(path, f"row 1: the column {twice!r} is there twice", "Give every column its own name.")
    return names, units


def _numbers(path: Path, rows: list[tuple[int, str]], separator: str, names: list[str]) -> FloatArray:
    if not rows:
        return np.empty((0, len(names)))
    comma = separator != ","
    try:
        text = (line.replace(",", ".") if comma else line for _, line in rows)
        table = np.loadtxt(text, delimiter=separator, ndmin=2, comments=None)
        if table.shape == (len(rows), len(names)):
            return table
    except (ValueError, IndexError):
        pass
    return np.array([_row(path, number, line, separator, names) for number, line in rows]).reshape(len(rows), len(names))


def _row(path: Path, number: int, line: str, separator: str, names: list[str]) -> list[float]:
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    if len(cells) < len(names) or any(cells[len(names) :]):
        raise BadRecording(path, f"row {number} has {len(cells)} columns, the first row {len(names)}", "Give every row the same columns.")
    values = []
    for name, cell in zip(names, cells, strict=False):
        try:
            values.append(np.nan if cell.lower() in MISSING else float(cell.replace(",", ".") if separator != "," else cell))
        except ValueError:
            _not_a_number(path, number, name, cell)
    return values


def _not_a_number(path: Path, number: int, name: str, cell: str) -> NoReturn:
    raise BadRecording(path, f"row {number}, column {name!r}: {cell!r} is not a number", "Correct or delete that row.")


def _columns(names: list[str], kinds: tuple[str, ...]) -> dict[str, int]:
    """Axis name -> column, for the columns of one kind."""
    found: dict[str, int] = {}
    for kind in kinds:
        for column, name in enumerate(names):
            axis, _, ending = name.rpartition("_")
            if ending == kind and (axis or name == kind):
                found.setdefault(axis or "x", column)
        if found:
            break
    return found


def _table(
    path: Path, names: list[str], units: list[str], table: FloatArray, input_key: str | None, output_key: str | None, notes: list[str]
) -> Table:
    has = f"it has {', '.join(names)}"
    times = [names.index(name) for name in TIMES if name in names]
    if not times:
        raise BadRecording(path, f"no time column; {has}", EXAMPLE)
    found: list[dict[str, int]] = []
    for key, kinds in ((input_key, INPUTS), (output_key, OUTPUTS)):
        columns = {"x": names.index(key)} if key in names else _columns(names, (key,) if key else kinds)
        if not columns:
            raise BadRecording(path, f"no {key or kinds[0]} column; {has}", EXAMPLE)
        found.append(columns)
    inputs, outputs = found
    axes = tuple(axis for axis in inputs if axis in outputs)
    if not axes:
        raise BadRecording(path, f"no axis has both voltage and position; {has}", EXAMPLE)
    if set(inputs) != set(outputs):
        notes.append(f"only {', '.join(axes)} has both voltage and position; the others are left out")
    references = _columns(names, REFERENCES)
    time, _ = to_si(table[:, times[0]], units[times[0]], "time", notes)
    numbers = [names.index(name) for name in NUMBERS if name in names]
    input_unit, output_unit = (_unit(path, units, [columns[a] for a in axes], usual) for columns, usual in ((inputs, "V"), (outputs, "m")))
    return Table(
        axes=axes,
        time=time,
        fs=None,
        seq=table[:, numbers[0]] if numbers else None,
        input=table[:, [inputs[axis] for axis in axes]],
        output=table[:, [outputs[axis] for axis in axes]],
        reference=table[:, [references[axis] for axis in axes]] if all(axis in references for axis in axes) else None,
        input_unit=input_unit,
        output_unit=output_unit,
    )


def _unit(path: Path, units: list[str], columns: list[int], usual: str) -> str:
    given = {units[column] or usual for column in columns}
    if len(given) > 1:
        raise BadRecording(path, f"axes in different units ({', '.join(sorted(given))})", "Give all axes of one kind the same unit.")
    return given.pop()


def write(path: Path, recording: Recording) -> None:
    """Every number exactly (17 digits); ``seq`` is written where the times alone would not give it back."""
    names, columns = ["time"], [recording.time]
    steps = np.rint((recording.time - recording.time[0]) * rate_from_time(recording.time)) if len(recording) > 1 else np.zeros(len(recording))
    if not np.array_equal(recording.seq, steps):
        names.append("seq")
        columns.append(recording.seq.astype(np.float64))
    for index, axis in enumerate(recording.axes):
        names += [f"{axis}_voltage{_bracket(recording.input_unit, 'V')}", f"{axis}_position{_bracket(recording.output_unit, 'm')}"]
        columns += [recording.voltage[:, index], recording.position[:, index]]
        if recording.reference is not None:
            names.append(f"{axis}_reference{_bracket(recording.output_unit, 'm')}")
            columns.append(recording.reference[:, index])
    lines = (",".join(map(repr, row)) for row in np.column_stack(columns).tolist())
    path.write_text(",".join(names) + "\n" + "\n".join(lines) + "\n", "utf-8")


def _bracket(unit: str, usual: str) -> str:
    return "" if unit == usual else f"[{unit}]"
