"""Between two samples of the encoder: where the axis is, and in how many sub-steps it gets there."""

from __future__ import annotations

import math

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray


@compiled
def along(x: FloatArray, i: int, part: float) -> float:
    """Position a part (0..1) of the way from sample i to the next, m: on the parabola with the mean of both second differences."""
    straight: float = x[i] + part * (x[i + 1] - x[i])
    if i == 0 or i + 2 >= x.shape[0]:
        return straight
    bent: float = straight - 0.25 * part * (1.0 - part) * (x[i + 2] - x[i + 1] - x[i] + x[i - 1])
    return bent


@compiled
def pieces(part: float, cuts: float) -> tuple[int, int]:
    """Sub-steps before and after the voltage changes, a part (0..1) of the sample on; none is longer than a sample / cuts."""
    return max(math.ceil(part * cuts), 1), max(math.ceil((1.0 - part) * cuts), 1)
