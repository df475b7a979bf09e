"""Tables in other formats, of a known axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from helpers.cli_tools import rigid
from xy_sysid.samples.block import FloatArray

RATE = 1000.0
MADE = rigid(3000, RATE)
T, U, Y = MADE["t"], MADE["u"], MADE["y"]


def csv_of(path: Path, columns: Mapping[str, FloatArray | Sequence[str]], separator: str = ",") -> Path:
    """A CSV file with these columns; text unchanged, and an empty cell for NaN."""
    file = path / "data.csv"
    cells = [[one if isinstance(one, str) else "" if np.isnan(one) else repr(float(one)) for one in column] for column in columns.values()]
    lines = [separator.join(columns), *(separator.join(row) for row in zip(*cells, strict=True))]
    file.write_text("\n".join(lines) + "\n", "utf-8")
    return file
