"""How fast an axis moves where its recording begins: a recording that is cut out of a longer one does not begin at rest."""

from __future__ import annotations

from functools import cache

import numpy as np

from xy_sysid.samples.block import FloatArray

SHORTEST = 8  # samples from which a parabola and what it leaves are known
LONGEST = 0.2  # s of the beginning that may tell


def start_speed(sampling_rate: float, position: FloatArray) -> tuple[float, float]:
    """Speed at the first sample of a position (n,), and its standard deviation, m/s.

    The slope at the beginning of a parabola (Savitzky & Golay, Analytical Chemistry 36, 1964) through 8 samples, or 16, 32 ... as long as
    noise leaves more doubt than that the speed changes: the slope of a straight line differs by so much.
    """
    found, doubt, count = 0.0, np.inf, SHORTEST
    while count <= min(position.size, max(LONGEST * sampling_rate, SHORTEST)):
        slopes, spread = _slopes(count)
        begin = position[:count] - position[0]
        straight, bent = (slopes @ begin).tolist()
        left = begin - _parabola(count) @ begin
        noise, change = spread * float(np.sqrt(left @ left / (count - 3))), abs(bent - straight)
        found, doubt = bent, float(np.hypot(noise, change))
        if noise <= change:
            break
        count *= 2
    return found * sampling_rate, doubt * sampling_rate


@cache
def _slopes(count: int) -> tuple[FloatArray, float]:
    """(2, count) what gives the slope at the first sample of a straight line and of a parabola, per sample; spread of the second for noise of 1."""
    line, parabola = (np.linalg.pinv(np.vander(np.arange(count), order, increasing=True))[1] for order in (2, 3))
    return np.array([line, parabola]), float(np.linalg.norm(parabola))


@cache
def _parabola(count: int) -> FloatArray:
    """(count, count) what gives the parabola itself."""
    powers = np.vander(np.arange(count, dtype=np.float64), 3, increasing=True)
    return np.asarray(powers @ np.linalg.pinv(powers))
