"""Noise and count toggling of an encoder at rest. Only larger changes are motion."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from xy_sysid.samples.block import FloatArray

COUNTS, SIGMAS = 2.0, 9.0  # encoder counts, and standard deviations, by which two readings differ without motion at most once in months
MEMORY = 2000  # readings over which the noise is averaged
BENT = 6.0  # variance of a second difference of white noise of variance 1
THIRD = 20.0  # variance of a third difference
WORTH = 0.433  # independent squares per difference: neighbours share readings (correlations of -0.75, 0.3 and -0.05)
RISK = 1e-3  # probability that few readings underestimate the noise; SIGMAS cover the rest


class EncoderNoise:
    """Estimates the noise from readings; ``still`` is the largest difference without motion.

    Noise is measured with third differences of consecutive readings: constant speed or acceleration has none, and a jerk can only
    increase the estimate. A few readings may underestimate the noise; therefore ``still`` uses the upper confidence limit of the variance.
    """

    def __init__(self, axes: int) -> None:
        self.count = np.full(axes, np.inf)  # m, the smallest change so far
        self.variance = np.zeros(axes)  # m^2 of one reading
        self._readings = 0
        self._last = np.empty((0, axes))
        self.still = np.zeros(axes)  # m, largest difference of two readings at rest

    def saw(self, values: FloatArray) -> None:
        """Add consecutive positions, (n, axes) in m."""
        rows = np.concatenate((self._last, values))
        steps = np.abs(np.diff(rows, axis=0))
        if len(steps):
            self.count = np.minimum(self.count, np.min(np.where(steps > 0, steps, np.inf), axis=0))
        if len(rows) > 3:
            bent = np.diff(rows, 3, axis=0)
            self._readings = min(self._readings + len(bent), MEMORY)
            share = min(1.0, len(bent) / self._readings)
            self.variance += share * (np.mean(bent * bent, axis=0) / THIRD - self.variance)
        self._last = rows[-3:]
        self.still = self._resting()

    def _resting(self) -> FloatArray:
        squares = WORTH * self._readings
        if not squares:
            return np.full(len(self.count), np.inf if len(self._last) > 1 else 0.0)  # unknown so far
        sigma = np.sqrt(self.variance * max(squares / max(_least(squares), 1e-300), 1.0))
        return np.asarray(COUNTS * np.where(np.isfinite(self.count), self.count, 0.0) + SIGMAS * sigma)


@lru_cache(maxsize=MEMORY)
def _least(squares: float) -> float:
    """The value below which a sum of this many squares falls with probability RISK (chi-squared)."""
    return 2.0 * float(scipy.special.gammaincinv(squares / 2.0, RISK))
