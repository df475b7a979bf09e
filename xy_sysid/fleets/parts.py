"""One long recording -> rows of its consecutive parts: the trend within a day, with only one part in memory."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

from xy_sysid.errors import BadInput
from xy_sysid.files.effects import library
from xy_sysid.fleets.history import BEGIN
from xy_sysid.fleets.naming import date_within, name_of
from xy_sysid.fleets.of_paths import Analysis
from xy_sysid.fleets.row import Plan, Row, row_of
from xy_sysid.imports.in_parts import SHORTEST, in_parts

UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def seconds(text: str) -> float:
    """A duration in s from text like 10min, 90s or 1h. Raises BadInput."""
    found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*(s|min|h|d|)", text.strip())
    act = "Write for example 10min, 90s or 1h."
    if found is None:
        raise BadInput("--every", repr(text), "a number and one of the units s, min, h and d", act)
    every = float(found.group(1)) * UNITS[found.group(2)]
    if every < SHORTEST:
        raise BadInput("--every", repr(text), f"a time of {SHORTEST:g} s or more", act)
    return every


def rows_of_parts(path: Path, every: float, how: Analysis, tell: Callable[[int], None] = lambda _: None) -> list[Row]:
    """The rows of each part of a recording.

    every: s of a part; tell: called with the number of finished parts. The date of a part is its start; without a clock, 1970 plus the time since
    the start. A part without samples has no row. Raises BadRecording or BadInput for a recording that cannot be read.
    """
    how.check()
    name, known = name_of(path, how.names), library(how.effect_files)
    plan = Plan(follow=tuple(how.names.follow), library=known)
    rows: list[Row] = []
    begin: datetime | None = None
    for number, part in in_parts(path, how.reading, every):
        begin = begin or name.date or date_within(part) or BEGIN
        for axis in part.axes:
            own = {"machine": name.of(part), "source": f"{path}#{number}", "date": begin + timedelta(seconds=number * every)}
            row = row_of(part, axis, plan)
            if row.get("effects") and axis not in dict(plan.first):
                plan = dataclasses.replace(plan, first=(*plan.first, (axis, tuple(row["effects"].split(", ")))))
            rows.append(row | ({"axis": name.axis} if name.axis and len(part.axes) == 1 else {}) | own)
        tell(number + 1)
    return rows
