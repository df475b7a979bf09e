"""WPILib data log (.wpilog), by robotpy-wpiutil. Every entry has its own time stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np


def leaves(path: str) -> Iterator[tuple[str, Any, str, str]]:
    """Entries of numbers, with their instants; each number of an array is a separate entry."""
    from wpiutil.log import DataLogReader

    reader = DataLogReader(path)
    if not reader.isValid():
        raise ValueError("no WPILib data log")
    names: dict[int, tuple[str, str]] = {}
    found: dict[int, list[tuple[float, list[float]]]] = {}
    for record in reader:
        if record.isStart():
            start = record.getStartData()
            names[start.entry] = start.name, start.type
        elif not record.isControl() and record.getEntry() in names:
            get = _getter(names[record.getEntry()][1], record)
            if get is not None:
                value = get()
                found.setdefault(record.getEntry(), []).append((1e-6 * record.getTimestamp(), value if isinstance(value, list) else [value]))
    for entry, rows in found.items():
        name = names[entry][0].removeprefix("NT:").strip("/").replace("/", ".")
        width = min(len(values) for _, values in rows)
        clock = f"time of {name}"
        yield clock, np.array([instant for instant, _ in rows]), "s", ""
        for place in range(width):
            shown = name if len(rows[0][1]) == 1 else f"{name}[{place}]"
            yield shown, np.array([values[place] for _, values in rows], np.float64), "", clock


def _getter(kind: str, record: Any) -> Callable[[], Any] | None:
    getters = {"double": "Double", "float": "Float", "int64": "Integer", "boolean": "Boolean"}
    of = getters.get(kind.removesuffix("[]"))
    if of is None:
        return None
    found: Callable[[], Any] = getattr(record, f"get{of}Array" if kind.endswith("[]") else f"get{of}")
    return found
