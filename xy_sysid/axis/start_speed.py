"""The speed of an axis at the start of its recording: a recording cut from a longer one does not start at rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from xy_sysid.samples.block import FloatArray

SHORTEST = 8  # least samples for a parabola and its residual
LONGEST = 0.2  # s, longest part of the start that is used


def start_speed(sampling_rate: float, position: FloatArray) -> tuple[float, float]:
    """Speed at the first sample of a position (n,), and its standard deviation, m/s.

    The initial slope of a parabola (Savitzky & Golay, Analytical Chemistry 36, 1964) through 8, 16, 32 ... samples, as long as the uncertainty by
    noise is larger than that by the parabola's shape, which is the difference to a cubic's slope.
    """
    found, doubt, count = 0.0, np.inf, SHORTEST
    while count <= min(position.size, max(LONGEST * sampling_rate, SHORTEST)):
        bent, cubic = (_fit(count, order) for order in (2, 3))
        begin = position[:count] - position[0]
        left = begin - cubic.values @ begin
        noise = float(np.linalg.norm(bent.slope)) * float(np.sqrt(left @ left / (count - 4)))
        found, beyond = float(bent.slope @ begin), abs(float((cubic.slope - bent.slope) @ begin))
        doubt = float(np.hypot(noise, beyond))
        if noise <= beyond:
            break
        count *= 2
    return found * sampling_rate, doubt * sampling_rate


@dataclass(frozen=True, slots=True)
class _Fit:
    """Weights for a polynomial's slope at the first sample, per sample, (n,), and for its values (n, n)."""

    slope: FloatArray
    values: FloatArray


@cache
def _fit(count: int, order: int) -> _Fit:
    powers = np.vander(np.arange(count, dtype=np.float64), order + 1, increasing=True)
    inverse = np.linalg.pinv(powers)
    return _Fit(inverse[1], powers @ inverse)
