"""Klipper's raw accelerometer data (raw_data_axis=x_*.csv): time in s and accelerations in mm/s^2. Klipper stores no command with it.

Source: Klipper, docs/Measuring_Resonances.md; klippy/extras/adxl345.py, AccelQueryHelper.write_to_file.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from xy_sysid.imports import csv
from xy_sysid.imports.sheet import Sheet

UNIT = "mm/s^2"


def sheet(path: Path) -> Sheet:
    """The columns, with Klipper's units."""
    found = csv.sheet(path)
    return replace(found, columns=tuple(replace(one, unit=UNIT if one.name.startswith("accel") else "s") for one in found.columns))
