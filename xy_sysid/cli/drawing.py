"""A curve in a terminal, drawn with braille dots."""

from __future__ import annotations

import numpy as np

from xy_sysid.samples.block import FloatArray

DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # bit of each dot in a braille cell, by row and column


def curve(x: FloatArray, y: FloatArray, width: int, height: int, low: float, high: float) -> list[str]:
    """Lines of text with y over log x; low and high are the bottom and top of the picture.

    Each dot column shows all values between its lowest and highest, so that no peak is lost.
    """
    columns, rows = 2 * width, 4 * height
    cells = np.zeros((height, width), dtype=np.int64)
    good = np.isfinite(y) & (x > 0)
    if np.count_nonzero(good) > 1 and high > low:
        place = np.log(x[good] / x[good][0]) / np.log(x[good][-1] / x[good][0]) * (columns - 1)
        grid = np.arange(columns)
        middle = np.interp(grid, place, y[good])
        for column in grid:
            inside = y[good][np.abs(place - column) <= 0.5]
            values = np.append(inside, middle[column])
            top = int(np.clip((high - values.max()) / (high - low) * (rows - 1), 0, rows - 1))
            bottom = int(np.clip((high - values.min()) / (high - low) * (rows - 1), 0, rows - 1))
            for row in range(top, bottom + 1):
                cells[row // 4, column // 2] |= DOTS[row % 4][column % 2]
    return ["".join(chr(0x2800 + int(cell)) for cell in line) for line in cells]
