"""The table in a text file: its first row, column names and separator."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.imports.echoed import joint_states
from xy_sysid.imports.foreign_units import unit_of
from xy_sysid.imports.names import header

MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "inf", "-inf")
BLANKS = " "  # one or more blanks of any kind
SEPARATORS = (";", "\t", ",", BLANKS)  # of equally good separators the first is used
PROBES = 7  # rows of the second half of the file that show its form
LOOK = 200  # first rows, in which the table begins
STEADY = 20  # rows of which more than half must look like data at the beginning of the table
REMARKS = ("#", "%", "//")  # first signs of a line that is a remark
WORD = re.compile(r'"[^"]*"|\S+')
BRACKETS = "[](){}"
Rows = list[tuple[int, str]]
Names = list[tuple[str, str]]  # with their units


@dataclass(frozen=True, slots=True)
class TextTable:
    """separator: between cells; names: of the columns, numbers if the file has none; rows: row number and text of the data rows.

    stamped: the first two columns are the seconds and nanoseconds of a stamp
    """

    separator: str
    names: Names
    rows: Rows
    stamped: bool = False


def text_table(text: str, notes: list[str]) -> TextTable:
    """The table of a text; empty if there are no rows. Adds notes on skipped rows and on assumptions."""
    lines = text.splitlines()
    rows = list(enumerate(lines, 1))
    if not all(map(str.strip, lines)):
        rows = [row for row in rows if row[1].strip()]
    remarks: Rows = []
    if any(sign in text for sign in REMARKS):
        remarks = [(number, line.strip().lstrip("#%/").strip()) for number, line in rows if _is_remark(line)]
        rows = [row for row in rows if not _is_remark(row[1])]
    if not rows:
        return TextTable(",", [], [])
    separator = _separator(rows)
    width = Counter(len(cells_of(line, separator)) for _, line in _probes(rows)).most_common(1)[0][0]
    begin = _beginning(rows, separator, width)
    head = _trimmed(cells_of(rows[begin][1], separator, width))
    if begin:
        notes.append(f"row {rows[0][0]} to {rows[begin - 1][0]} are no columns ({rows[0][1][:40]!r}); they are left out")
        head = head[:width]
    joints = joint_states(head) if separator == "," else None
    if joints is not None:
        notes.append("rows without names are read as ros2 topic echo --csv prints sensor_msgs/JointState")
        return TextTable(separator, [(name, "") for name in joints], rows[begin:], stamped=True)
    if not all(is_number(cell, separator) for cell in head):
        names, data = _with_units([header(cell) for cell in head], rows[begin + 1 :], separator)
        return TextTable(separator, names, data)
    above = [line for number, line in remarks if number < rows[begin][0]][-1:]
    called = cells_of(above[0], separator, len(head)) if above else []
    if len(called) == len(head) > 1:
        notes.append(f"the columns have the names in the remark above them ({above[0][:40]!r})")
        return TextTable(separator, [header(cell) for cell in called], rows[begin:])
    notes.append("the first row holds numbers and no names; the columns are numbered from 1")
    return TextTable(separator, [(str(number), "") for number in range(1, len(head) + 1)], rows[begin:])


def cells_of(line: str, separator: str, width: int = 0) -> list[str]:
    """The cells of a row; a separator within quotes belongs to its cell. width: expected number, if names may contain blanks."""
    if separator == BLANKS:
        cells = [cell.strip('"') for cell in WORD.findall(line)]
        apart = [cell.strip() for cell in re.split(r"\s{2,}|\t", line.strip())]
        return apart if width and len(cells) != width == len(apart) else cells
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    cells, part, quoted = [], "", False
    for sign in line:
        quoted ^= sign == '"'
        if sign == separator and not quoted:
            cells.append(part)
            part = ""
        elif sign != '"':
            part += sign
    return [cell.strip() for cell in (*cells, part)]


def number_of(cell: str, separator: str) -> float:
    """The number of a cell, NaN for a missing value; raises ValueError. The decimal sign may be a comma unless commas separate cells."""
    return np.nan if cell.lower() in MISSING else float(cell.replace(",", ".") if separator != "," else cell)


def is_number(cell: str, separator: str) -> bool:
    """True if a cell is a finite number."""
    try:
        return bool(np.isfinite(number_of(cell, separator)))
    except ValueError:
        return False


def _probes(rows: Rows) -> Rows:
    """Some rows from the second half, without the last one, which may be cut."""
    later = rows[len(rows) // 2 : -1] or rows[-1:]
    return [later[round(place)] for place in np.linspace(0, len(later) - 1, min(PROBES, len(later)))]


def _separator(rows: Rows) -> str:
    """The separator that gives the most numbers and fewest words; if there are more words, the most frequent one in the first row."""

    def numbers(separator: str) -> int:
        parted = [cells_of(line, separator) for _, line in _probes(rows)]
        return sum((1 if is_number(cell, separator) else -1) for row in parted for cell in row if cell)

    counts = {separator: numbers(separator) for separator in SEPARATORS}
    best = max(SEPARATORS, key=lambda separator: counts[separator])
    if counts[best] > 0:
        return best
    head = rows[0][1]
    return max(SEPARATORS[:-1], key=head.count) if any(sign in head for sign in SEPARATORS[:-1]) else ","


def _beginning(rows: Rows, separator: str, width: int) -> int:
    """Index of the row of names, or of the first data row if there is none; rows above are no part of the table."""
    cells = [cells_of(line, separator, width) for _, line in rows[: LOOK + STEADY]]
    wide = [len(row) >= width for row in cells]
    probes = [row for row in (cells_of(line, separator) for _, line in _probes(rows)) if len(row) == width]
    places = [place for place in range(width) if all(is_number(row[place], separator) for row in probes)]

    def like_data(row: Sequence[str]) -> bool:
        return len(row) == width and all(row[place].lower() in MISSING or is_number(row[place], separator) for place in places)

    usual = [bool(places) and like_data(row) for row in cells]
    first = next((at for at in range(len(cells)) if usual[at] and 2 * sum(usual[at : at + STEADY]) > len(usual[at : at + STEADY])), 0)

    def names(at: int) -> bool:
        return at >= 0 and wide[at] and 2 * sum(map(bool, cells[at])) > width and not any(is_number(cell, separator) for cell in cells[at])

    begin = first - names(first - 1)
    begin -= begin < first and names(begin - 1) and _are_units(cells[begin], separator)
    if begin < first or not wide[0]:  # names directly above the data, or titles that have fewer cells
        return begin if first else (wide.index(True) if any(wide) else 0)
    return 0


def _with_units(names: Names, rows: Rows, separator: str) -> tuple[Names, Rows]:
    """Names with units from a row below them, and the rows without it; unchanged if there is none."""
    cells = [cell.strip(BRACKETS) for cell in cells_of(rows[0][1], separator, len(names))][: len(names)] if rows else []
    if len(cells) < len(names) or not _are_units(cells, separator):
        return names, rows
    return [(name, unit or cell) for (name, unit), cell in zip(names, cells, strict=True)], rows[1:]


def _is_remark(line: str) -> bool:
    """Whether a line is a remark, and not a row of units, which may begin with %."""
    return line.lstrip().startswith(REMARKS) and any(unit_of(cell).quantity == "unknown" for cell in re.split(r"[\s;,]+", line.strip()))


def _are_units(cells: Sequence[str], separator: str) -> bool:
    """Whether a row holds units: more than half of its cells are known units, and none is a number."""
    texts = [cell.strip(BRACKETS) for cell in cells if cell]
    known = sum(unit_of(text).quantity != "unknown" for text in texts)
    return 2 * known > len(texts) and not any(is_number(text, separator) for text in texts)


def _trimmed(cells: list[str]) -> list[str]:
    while len(cells) > 1 and not cells[-1]:
        cells = cells[:-1]
    return cells
