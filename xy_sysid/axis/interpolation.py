"""Between two encoder samples: the position of the axis, and the number of sub-steps."""

from __future__ import annotations

import math

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray


@compiled
def along(x: FloatArray, i: int, part: float) -> float:
    """Position at a fraction ``part`` (0..1) between sample i and the next, m: on the parabola with the mean of both second differences."""
    straight: float = x[i] + part * (x[i + 1] - x[i])
    if i == 0 or i + 2 >= x.shape[0]:
        return straight
    bent: float = straight - 0.25 * part * (1.0 - part) * (x[i + 2] - x[i + 1] - x[i] + x[i - 1])
    return bent


@compiled
def pieces(part: float, cuts: float) -> tuple[int, int]:
    """Number of sub-steps before and after the voltage changes at a fraction ``part`` of the sample; none is longer than a sample / cuts."""
    return max(math.ceil(part * cuts), 1), max(math.ceil((1.0 - part) * cuts), 1)
