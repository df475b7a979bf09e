"""Impulse and step, alternately up and down, so that an integrating axis returns.

Both rest first, the step for one ``period``, the impulse for one sample less, so that the ramp-in is complete. The impulse is one
sample per period; the step holds for one period and rests for one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from xy_sysid.excitation.contract import Parts, samples
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation

PIECE = 4096  # samples generated at a time, so that a long period needs little memory


def _runs(runs: list[tuple[float, int]]) -> Iterator[FloatArray]:
    """Constant values, each for this many samples, repeated endlessly, in pieces."""
    while True:
        for value, length in runs:
            for start in range(0, length, PIECE):
                yield np.full(min(PIECE, length - start), value)


def impulse(settings: AxisExcitation, rate: float) -> Parts:
    """The last sample of each period is alternately +rms and -rms, V; the others are 0. Raises BadInput for too short a period."""
    rest = samples(settings.period, rate, 2, "period") - 1
    return Parts.of(_runs([(0.0, rest), (settings.rms, 1), (0.0, rest), (-settings.rms, 1)]))


def step(settings: AxisExcitation, rate: float) -> Parts:
    """0, +rms, 0, -rms, V, each for a period, repeated. Raises BadInput for too short a period."""
    period = samples(settings.period, rate, 1, "period")
    return Parts.of(_runs([(0.0, period), (settings.rms, period), (0.0, period), (-settings.rms, period)]))


def off(_settings: AxisExcitation, _rate: float) -> Parts:
    """0 V without end: this axis is only held."""
    return Parts.of(_runs([(0.0, PIECE)]))
