"""Impulse and step, up and down in turn, so that an axis that integrates comes back.

Both rest for one ``period`` first, so that the ramp-in is over. The impulse is one sample a period; the step holds for one
period and rests for one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from xy_sysid.excitation.contract import Parts, samples
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation

PIECE = 4096  # samples made at a time, so that a long period takes no memory


def _runs(runs: list[tuple[float, int]]) -> Iterator[FloatArray]:
    """Constant values, each for so many samples, repeated for ever in pieces."""
    while True:
        for value, length in runs:
            for start in range(0, length, PIECE):
                yield np.full(min(PIECE, length - start), value)


def impulse(settings: AxisExcitation, rate: float) -> Parts:
    """The last sample of each period is +rms V and -rms V in turn, the others 0."""
    rest = samples(settings.period, rate, 2, "period") - 1
    return Parts.of(_runs([(0.0, rest), (settings.rms, 1), (0.0, rest), (-settings.rms, 1)]))


def step(settings: AxisExcitation, rate: float) -> Parts:
    """Zero, +rms V, zero, -rms V, each for a period, and again."""
    period = samples(settings.period, rate, 1, "period")
    return Parts.of(_runs([(0.0, period), (settings.rms, period), (0.0, period), (-settings.rms, period)]))


def off(settings: AxisExcitation, rate: float) -> Parts:
    """Zero for ever: this axis is only held."""
    return Parts.of(_runs([(0.0, PIECE)]))
