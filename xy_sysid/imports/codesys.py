"""Trace of CODESYS, ctrlX and other controls based on it (.trace.csv): ``key; value`` rows, and the samples of each variable below its ``Data``.

Times are in ms from the start of the trace. Source: files of AragakiCH/ctrlx_sysid.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.arrays import short
from xy_sysid.imports.csv import text_of
from xy_sysid.imports.sheet import Column, Sheet

KEY = re.compile(r"(\d+)\.(\w[\w.]*)\s*;\s*(.*)")
PER_SECOND = 1e-3


def sheet(path: Path) -> Sheet:
    """A column for each variable, with its own times."""
    names: dict[str, str] = {}
    samples: dict[str, list[tuple[float, float]]] = {}
    current = ""
    for number, line in enumerate(text_of(path).splitlines(), 1):
        key = KEY.match(line)
        if key is not None:
            current = ""
            if key[2] == "Variable":
                names[key[1]] = key[3].strip()
            elif key[2] == "Data":
                current = key[1]
        elif current and line.strip():
            cells = line.split(";")
            try:
                samples.setdefault(current, []).append((float(cells[-2]), float(cells[-1])))
            except (ValueError, IndexError):
                raise BadRecording(path, f"row {number} is {line[:40]!r} and no sample", "Export the trace again.") from None
    if not samples:
        raise BadRecording(path, "a CODESYS trace without samples", "Record the trace and export it again.")
    columns = []
    for place, rows in samples.items():
        numbers = np.array(rows)
        columns.append(Column(names.get(place, place), "", numbers[:, 1], clock=PER_SECOND * numbers[:, 0]))
    return Sheet(path=path, columns=tuple(short(columns)), kind="variable")
