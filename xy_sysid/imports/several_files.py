"""Input and output in two files: ``--map input=u.csv:1,output=y.csv:2`` names a file and its column. They are joined by time or by row."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.instants import Stamps, stamps
from xy_sysid.imports.names import meaning
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.registry import BAG, format_of, sheet_of
from xy_sysid.imports.sheet import Sheet
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import listed


def of_several_files(path: Path, reading: Reading, notes: list[str]) -> tuple[Sheet, Reading] | None:
    """One sheet with the columns of all files that the reading names, and the reading for this sheet; None if it names no file.

    The files are joined by their times if all have one, otherwise by row. Raises BadRecording if their numbers of rows differ then.
    """
    named = {what: found for what, column in reading.columns.items() if (found := file_and_column(path, column)) is not None}
    if not named:
        return None
    sheets = {file: sheet_of(file, format_of(file)) for file in dict.fromkeys([path, *(file for file, _ in named.values())]) if _is_table(file)}
    chosen = {what: named.get(what, (path, column)) for what, column in reading.columns.items()}
    used = dict.fromkeys(file for file, _ in chosen.values())
    time = chosen.get("time")
    joined = dict.fromkeys(file for what, (file, _) in chosen.items() if what != "time")
    by_row = reading.rate is not None or (time is not None and (time[0] not in joined or len(joined) < 2))
    said = {time[0]: time[1]} if time is not None else {}
    clocks = None if by_row else _on_one_clock({file: _stamps(sheets[file], said.get(file, ""), reading) for file in joined})
    if clocks is not None:
        chosen.pop("time", None)
    columns = [
        replace(sheets[file].find(name), name=f"{what} in {file.name}", clock=None if clocks is None else clocks[file])
        for what, (file, name) in chosen.items()
    ]
    files = listed([file.name for file in used])
    rows = {file.name: len(sheets[file].find(name).values) for file, name in chosen.values()}
    if clocks is None and len(set(rows.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in rows.items())
        raise BadRecording(path, f"the files have different numbers of rows ({counts}) and not all have a time", "Cut them to the same samples.")
    notes.append(f"{files} are joined {'row by row' if clocks is None else 'by their times'}")
    rate = next((sheets[file].fs for file in used if sheets[file].fs is not None), None)
    told = dict(zip(chosen, (column.name for column in columns), strict=True))
    return Sheet(path=path, columns=tuple(columns), fs=rate), dataclasses.replace(reading, columns=told)


def file_and_column(path: Path, text: str) -> tuple[Path, str] | None:
    """The file and the column that FILE:COLUMN names, FILE relative to the folder of ``path`` or as given. None if there is no such file."""
    name, colon, column = text.rpartition(":")
    if not (colon and name and column):
        return None
    for file in (path.parent / name, Path(name)):
        try:
            if file.is_file():
                return file, column
        except OSError:
            continue
    return None


def others(path: Path, columns: Mapping[str, str]) -> set[Path]:
    """The absolute paths of the files that FILE:COLUMN texts name."""
    return {found[0].resolve() for text in columns.values() if (found := file_and_column(path, text)) is not None}


def _is_table(path: Path) -> bool:
    return format_of(path) is not BAG


def _stamps(sheet: Sheet, time: str, reading: Reading) -> Stamps | None:
    """The instants of a file, from its column ``time`` if given, otherwise from a column with that meaning; None without one."""
    if time:
        return stamps(sheet.path, sheet.find(time), reading, [])
    for column in sheet.columns:
        known = meaning(column.name, column.unit)
        if known is not None and known.role == "time" and (column.words or np.all(np.isfinite(column.values))):
            return stamps(sheet.path, column, reading, [])
    return None


def _on_one_clock(found: Mapping[Path, Stamps | None]) -> dict[Path, FloatArray] | None:
    """The instants of each file, s, from one origin; None unless all have some."""
    told = {file: one for file, one in found.items() if one is not None}
    if len(told) < len(found) or not told:
        return None
    first = next(iter(told.values()))
    return {file: one.after(first) if any(each.far for each in told.values()) else one.seconds() for file, one in told.items()}
