"""A fleet's table without recordings: three axes, one of which loses gain."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import merged

BEGIN = datetime(2026, 1, 5, tzinfo=UTC)
COUNT = 14  # recordings of each axis, two weeks apart


def recorded(machine: str, number: int, gain: float, **changes: Any) -> Row:
    """The row of one recording of axis x, ``number`` fortnights after the first one. changes: of its columns."""
    source = f"{machine}-{number}"
    name = {"machine": machine, "axis": "x", "date": BEGIN + timedelta(days=14 * number), "source": source, "key": source}
    answer = {"verdict": "nothing_missing", "effects": "", "input_unit": "V", "output_unit": "m", "one_step": False}
    return name | answer | {"gain": gain, "gain_low": 0.999 * gain, "gain_high": 1.001 * gain} | changes


def unread(machine: str, number: int) -> Row:
    """The row of a recording that could not be read."""
    return {**recorded(machine, number, 0.0), "axis": "", "verdict": None, "gain": None, "gain_low": None, "gain_high": None, "stage": "reading"}


def scattered_gains(number: int, count: int = COUNT) -> list[float]:
    """Gains of an axis that does not change."""
    return [float(gain) for gain in 0.1 * (1.0 + 0.004 * np.random.default_rng(number).standard_normal(count))]


def gain_falls(folder: Path) -> Path:
    """mill-01 loses a tenth of its gain on 25 May 2026; a row without a date and a recording that could not be read are among them."""
    folder.mkdir()
    rows = [unread("mill-00", 3)]
    for number in range(3):
        for k, gain in enumerate(scattered_gains(number)):
            rows.append(recorded(f"mill-0{number}", k, gain * (0.9 if number == 1 and k >= 10 else 1.0)))
    rows.append({"machine": "mill-00", "axis": "x", "date": None, "source": "undated", "key": "u", "verdict": "nothing_missing"})
    merged(folder, rows)
    return folder
