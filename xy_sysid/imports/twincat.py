"""TwinCAT 3 Scope export (.csv, tabs): header lines, then rows in which each channel, or group of channels, has a column of times.

Values have the scaling of the Scope. Source: Beckhoff, TE13xx TwinCAT 3 Scope View, "Export tool"; files of CagtayFabry/pytcs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.csv import text_of
from xy_sysid.imports.foreign_units import unit_of
from xy_sysid.imports.sheet import Column, Sheet
from xy_sysid.imports.text_table import number_of

TIME = "SampleTime"  # label of the line that gives the unit of the times


def sheet(path: Path) -> Sheet:
    """A column for each channel, with its own times since the start of the export."""
    lines = text_of(path).splitlines()
    top = next(place for place, line in enumerate(lines) if line.startswith(TIME))
    names = max(place for place in range(top) if lines[place].startswith("Name\t"))
    head = lines[names].split("\t")
    begin = next((place for place in range(top, len(lines)) if _is_number(lines[place].split("\t")[0])), len(lines))
    header = {cells[0]: cells for cells in (line.split("\t") for line in lines[names:begin]) if cells[0]}
    clocks = [place for place, cell in enumerate(head) if header[_label(header)][place : place + 1] == [_label(header)] and cell == "Name"]
    if not clocks or begin == len(lines):
        raise BadRecording(path, "a TwinCAT Scope export without channels or rows", "Export it again with at least one channel.")
    per_second = unit_of(_label(header).partition("[")[2].rstrip("]")).scale
    table = _table([line.split("\t") for line in lines[begin:]], len(head))
    columns = []
    for clock, end in zip(clocks, [*clocks[1:], len(head)], strict=True):
        time = per_second * table[:, clock]
        for place in range(clock + 1, end):
            rows = np.isfinite(time) & np.isfinite(table[:, place])
            columns.append(Column(head[place], _unit(header, place), table[rows, place], clock=time[rows]))
    return Sheet(path=path, columns=tuple(columns), kind="channel")


def _label(header: dict[str, list[str]]) -> str:
    return next(label for label in header if label.startswith(TIME))


def _unit(header: dict[str, list[str]], place: int) -> str:
    """V from "V (Voltage)", empty for "(None)"."""
    cells = header.get("Unit", [])
    text = cells[place] if place < len(cells) else ""
    return text.partition("(")[0].strip()


def _table(rows: list[list[str]], width: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(n, width) numbers; NaN for blank cells and those missing at the end of a row."""
    found = np.array([[_number(cell) for cell in row[:width]] + [np.nan] * (width - len(row)) for row in rows])
    found[~np.isfinite(found)] = np.nan
    return found


def _number(cell: str) -> float:
    try:
        return number_of(cell.strip(), "\t")
    except ValueError:
        return float("nan")


def _is_number(cell: str) -> bool:
    return bool(np.isfinite(_number(cell)))
