"""One long recording -> rows of its parts, one after another: a recording of a day as a trend, with no more than one part in memory."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

from xy_sysid.errors import BadInput
from xy_sysid.files.effects import library
from xy_sysid.fleets.history import BEGIN
from xy_sysid.fleets.naming import date_within, name_of
from xy_sysid.fleets.of_paths import Analysis
from xy_sysid.fleets.row import Plan, Row, row_of
from xy_sysid.imports import load
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.recording import Recording

UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
SHORTEST = 1.0  # s of a part


def seconds(text: str) -> float:
    """A time like 10min, 90s or 1h. Raises BadInput."""
    found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*(s|min|h|d|)", text.strip())
    if found is None or float(found.group(1)) * UNITS[found.group(2)] < SHORTEST:
        raise BadInput("--every", repr(text), f"a time of {SHORTEST:g} s or more", "Write for example 10min, 90s or 1h.")
    return float(found.group(1)) * UNITS[found.group(2)]


def rows_of_parts(path: Path, every: float, how: Analysis, tell: Callable[[int], None] = lambda _: None) -> list[Row]:
    """The rows of each part of a recording.

    every: s of a part; tell: hears how many parts are done. A part's date is when it began; where no clock tells the date, 1970 and the time since
    the start. A part that lies in a gap has no row. Raises BadRecording or BadInput for a recording that cannot be read.
    """
    how.check()
    name, known = name_of(path, how.names), library(how.effect_files)
    plan = Plan(follow=tuple(how.names.follow), library=known)
    rows: list[Row] = []
    begin, number, heard = None, 0, 0.0  # heard: the last instant that was read, s
    last = 0  # number of the last part, as far as it is known
    while True:
        start = how.reading.start + number * every
        stop = start + every if how.reading.stop is None else min(start + every, how.reading.stop)
        if stop <= start:
            return rows
        part = _part(path, dataclasses.replace(how.reading, start=start, stop=stop), first=number == 0)
        if part is None and number > last:  # a gap, or the end
            rest = _part(path, dataclasses.replace(how.reading, start=start), first=False)
            if rest is None:
                return rows
            last = number + int((rest.time[-1] - heard) / every) + 1
        if part is None:
            number += 1
            continue
        heard = part.time[-1]
        begin = begin or name.date or date_within(part) or BEGIN
        for axis in part.axes:
            own = {"machine": name.of(part), "source": f"{path}#{number}", "date": begin + timedelta(seconds=number * every)}
            row = row_of(part, axis, plan)
            if row.get("effects") and axis not in dict(plan.first):
                plan = dataclasses.replace(plan, first=(*plan.first, (axis, tuple(row["effects"].split(", ")))))
            rows.append(row | ({"axis": name.axis} if name.axis and len(part.axes) == 1 else {}) | own)
        number += 1
        tell(number)


def _part(path: Path, reading: Reading, first: bool) -> Recording | None:
    """What was read; None where nothing is there, which the first part raises as BadInput."""
    try:
        return load(path, reading)
    except BadInput as problem:
        if first or problem.what not in ("start", "start and stop"):
            raise
        return None
