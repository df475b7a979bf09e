"""How fast an axis moves where its recording begins: a recording that is cut out of a longer one does not begin at rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from xy_sysid.samples.block import FloatArray

SHORTEST = 8  # samples from which a parabola and what it leaves are known
LONGEST = 0.2  # s of the beginning that may tell


def start_speed(sampling_rate: float, position: FloatArray) -> tuple[float, float]:
    """Speed at the first sample of a position (n,), and its standard deviation, m/s.

    The slope at the beginning of a parabola (Savitzky & Golay, Analytical Chemistry 36, 1964) through 8 samples, or 16, 32 ... as long as
    noise leaves more doubt than that the motion is no parabola: a cubic's slope differs by so much.
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
    """What gives a polynomial's slope at the first sample, per sample, (n,), and its values (n, n)."""

    slope: FloatArray
    values: FloatArray


@cache
def _fit(count: int, order: int) -> _Fit:
    powers = np.vander(np.arange(count, dtype=np.float64), order + 1, increasing=True)
    inverse = np.linalg.pinv(powers)
    return _Fit(inverse[1], powers @ inverse)
