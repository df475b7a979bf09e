"""A fleet's table without recordings: three axes, one of which loses gain."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from xy_sysid.fleets.table import merged

BEGIN = datetime(2026, 1, 5, tzinfo=UTC)
COUNT = 14  # recordings of each axis, two weeks apart


def gain_falls(folder: Path) -> Path:
    """mill-01 loses a tenth of its gain on 25 May 2026; a row without a date is among them."""
    folder.mkdir()
    rows = []
    for number in range(3):
        scatter = 0.004 * np.random.default_rng(number).standard_normal(COUNT)
        for k in range(COUNT):
            gain = 0.1 * (1.0 + scatter[k]) * (0.9 if number == 1 and k >= 10 else 1.0)
            name = {
                "machine": f"mill-0{number}",
                "axis": "x",
                "date": BEGIN + timedelta(days=14 * k),
                "source": f"{number}-{k}",
                "key": f"{number}-{k}",
            }
            answer = {"verdict": "nothing_missing", "effects": "", "input_unit": "V", "output_unit": "m", "one_step": False}
            rows.append(name | answer | {"gain": gain, "gain_low": 0.999 * gain, "gain_high": 1.001 * gain})
    rows.append({"machine": "mill-00", "axis": "x", "date": None, "source": "undated", "key": "u", "verdict": "nothing_missing"})
    merged(folder, rows)
    return folder
