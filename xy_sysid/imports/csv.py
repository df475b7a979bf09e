"""CSV --> columns, and a recording --> CSV.

The first row names the columns, with the unit in brackets if it is not SI: ``x_position[mm]`` or ``x_position (mm)``.
Columns are separated by comma, semicolon, tab or blanks; the decimal sign may be a comma unless commas separate (``imports.text_table``).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.echoed import stamped
from xy_sysid.imports.limits import MOST_COLUMNS
from xy_sysid.imports.sheet import Column, Sheet
from xy_sysid.imports.text_table import BLANKS, MISSING, SEPARATORS, Names, Rows, cells_of, is_number, number_of, text_table
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording, rate_from_time

EXAMPLE = "Name the columns like time,x_voltage,x_position[mm] in the first row."
HEADS = 10  # lines whose cells are counted before the file is parsed
PIECE = 1 << 24  # bytes read at once
LONGEST_LINE = 10_000_000  # bytes; a thousand for each of MOST_COLUMNS
LOOK = 200  # rows before the last one that show the usual length of its last number


def sheet(path: Path) -> Sheet:
    """The columns of a file; a cell that is not a number is reported when its column is used."""
    text = text_of(path)
    notes: list[str] = []
    widest = max(line.count(sign) for line in text.split("\n", HEADS)[:HEADS] for sign in SEPARATORS)
    if widest >= MOST_COLUMNS:
        problem = f"its first rows have up to {widest + 1} cells, and {MOST_COLUMNS} columns are read at most"
        raise BadRecording(path, problem, "Give a file with one column per signal.")
    found = text_table(text, notes)
    if not found.names:
        raise BadRecording(path, "the file holds no rows", EXAMPLE)
    rows = _without_words(found.rows, found.separator, notes)
    if rows[-1:] == found.rows[-1:] and not text.endswith(("\n", "\r")):
        rows = _whole(rows, found.separator, len(found.names), notes)
    columns, bad = _columns(path, rows, found.separator, found.names)
    return Sheet(path=path, columns=stamped(columns) if found.stamped else columns, notes=tuple(notes), bad=bad)


def text_of(path: Path) -> str:
    """The file's text: UTF-16 if it has its mark, otherwise UTF-8 or the Windows code page 1252."""
    raw = _raw(path)
    for code in ("utf-16",) if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else ("utf-8-sig", "cp1252"):
        try:
            text = raw.decode(code)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise BadRecording(path, "not a text file", "Save it as CSV in UTF-8.")


def _raw(path: Path) -> bytes:
    """The file's bytes. Raises BadRecording, before it reads the rest, for a line longer than any table has."""
    parts: list[bytes] = []
    open_line = 0  # bytes since the last end of a line
    with path.open("rb") as file:
        while part := file.read(PIECE):
            bytes_ = np.frombuffer(part, np.uint8)
            ends = np.flatnonzero((bytes_ == ord("\n")) | (bytes_ == ord("\r")))
            lengths = np.diff(ends, prepend=-1 - open_line, append=len(part))
            if lengths.max() > LONGEST_LINE:
                problem = f"a line of more than {LONGEST_LINE / 1e6:.0f} million characters, so not a table"
                raise BadRecording(path, problem, "Save it with one line for each sample.")
            open_line = int(lengths[-1]) - 1
            parts.append(part)
    return b"".join(parts)


def _without_words(rows: Rows, separator: str, notes: list[str]) -> Rows:
    """The rows without last ones that begin with a word, such as means, if the first row begins with a number."""

    def begins(row: tuple[int, str]) -> str:
        return cells_of(row[1], separator)[0]

    end = len(rows)
    if rows and is_number(begins(rows[0]), separator):
        while (first := begins(rows[end - 1])).lower() not in MISSING and not is_number(first, separator):
            end -= 1
    if end < len(rows):
        notes.append(f"row {rows[end][0]} to {rows[-1][0]} are no data ({rows[end][1][:40]!r}); they are left out")
    return rows[:end]


def _whole(rows: Rows, separator: str, width: int, notes: list[str]) -> Rows:
    """The rows without the last one if the file ends inside it: it has too few cells, or a shorter number than the others."""
    if not rows:
        return rows
    number, line = rows[-1]
    cells = cells_of(line, separator)
    before = [cells_of(text, separator) for _, text in rows[-1 - LOOK : -1]]
    least = min((_digits(one[width - 1]) for one in before if len(one) >= width), default=0)
    cut = len(cells) < width or (not is_number(cells[width - 1], separator) and bool(before) and is_number(before[-1][-1], separator))
    if cut or _digits(cells[width - 1]) < least:
        notes.append(f"the file ends inside row {number} ({line[-20:]!r}); that row is left out")
        return rows[:-1]
    notes.append("the file does not end with the end of a line; if it was cut short, its last number may be wrong")
    return rows


def table_of(path: Path, names: Names, lines: list[str], first: int) -> tuple[Column, ...]:
    """The columns of rows of numbers separated by commas. first: row number of the first in the file."""
    return _columns(path, [(number, line) for number, line in enumerate(lines, first) if line.strip()], ",", names)[0]


def _digits(cell: str) -> int:
    """Number of digits after the decimal sign."""
    return len(cell) - 1 - max(cell.find("."), cell.find(",")) if "." in cell or "," in cell else 0


def _columns(path: Path, rows: Rows, separator: str, names: Names) -> tuple[tuple[Column, ...], dict[str, str]]:
    """The columns, and for each that holds something else than numbers the first such cell."""
    width = len(names)
    table = _quick(rows, separator, width)
    if table is not None:
        return tuple(Column(name, unit, table[:, place]) for place, (name, unit) in enumerate(names)), {}
    cells = [cells_of(line, separator) for _, line in rows]
    for (number, _), row in zip(rows, cells, strict=True):
        if len(row) < width or any(row[width:]):
            raise BadRecording(path, f"row {number} has {len(row)} columns, the first row {width}", "Give every row the same columns.")
    columns: list[Column] = []
    bad: dict[str, str] = {}
    for place, (name, unit) in enumerate(names):
        texts = [row[place] for row in cells]
        first = next((text for text in texts if text.lower() not in MISSING), "")
        values = np.full(len(texts), np.nan)
        if first and not is_number(first, separator):
            columns.append(Column(name, unit, values, tuple(texts)))
            continue
        for at, text in enumerate(texts):
            try:
                values[at] = number_of(text, separator)
            except ValueError:
                bad.setdefault(name, f"row {rows[at][0]}, column {name!r}: {text[:40]!r} is not a number")
        columns.append(Column(name, unit, values))
    return tuple(columns), bad


def _quick(rows: Rows, separator: str, width: int) -> FloatArray | None:
    """All cells at once, if all are numbers."""
    if not rows:
        return np.empty((0, width))
    try:
        lines = [line for _, line in rows]
        if separator != ",":
            lines = "\n".join(lines).replace(",", ".").split("\n")
        table = np.loadtxt(lines, delimiter=None if separator == BLANKS else separator, ndmin=2, comments=None)
    except (ValueError, IndexError):
        return None
    return np.asarray(table) if table.shape == (len(rows), width) else None


def write(path: Path, recording: Recording) -> None:
    """Write every number in full precision; ``seq`` is written only if it does not follow from the times."""
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
