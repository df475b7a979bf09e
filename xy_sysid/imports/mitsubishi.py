"""Mitsubishi MR Configurator graph (.csv): two header rows, the second of units and signals; torque in % of the rated one, speed in r/min.

Signals have the names of MR Configurator2. Digital ones have a level in V on the screen; they are states, so "state" is added to their names.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from xy_sysid.errors import BadRecording
from xy_sysid.imports import csv
from xy_sysid.imports.csv import text_of
from xy_sysid.imports.sheet import Column, Sheet

UNITS = {"speed": "rpm", "torque": "%", "current": "%", "pulses": "counts", "position": "counts"}  # by a word in the signal's name
NONE = "Not selected"
BY = re.compile(r"\(by (\d{1,6}) pls")  # pulses may be counted in hundreds


def sheet(path: Path) -> Sheet:
    """The time and the selected signals."""
    lines = text_of(path).splitlines()
    place = next((at for at, line in enumerate(lines) if line.startswith("Time,")), None)
    if place is None or place + 1 >= len(lines):
        raise BadRecording(path, "an MR Configurator graph without a row of signals", "Export it again as CSV.")
    kinds, names = (lines[at].split(",") for at in (place, place + 1))
    if len(kinds) != len(names):
        problem = f"row {place + 1} names {len(kinds)} signals, and row {place + 2} {len(names)}"
        raise BadRecording(path, problem, "Export it again as CSV.")
    found = csv.table_of(path, [(f"{at}", "") for at in range(len(names))], lines[place + 2 :], place + 3)
    columns = [Column("time", names[0], found[0].values)]
    for kind, name, column in zip(kinds[1:], names[1:], found[1:], strict=True):
        if name == NONE:
            continue
        digital = kind.startswith("Digital")
        unit = next((unit for word, unit in UNITS.items() if word in name.lower()), "")
        times = BY.search(name)
        column = replace(column, values=column.values * float(times[1])) if times else column
        columns.append(replace(column, name=f"{name} state" if digital else name.partition("(")[0].strip(), unit="" if digital else unit))
    return Sheet(path=path, columns=tuple(columns))
