"""What an encoder shows of an axis that rests: noise, and a last count that toggles. Motion is what goes beyond it."""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.samples.block import FloatArray

COUNTS, SIGMAS = 2.0, 9.0  # encoder counts, and standard deviations, by which two readings differ without motion: once in months of readings
MEMORY = 2000  # readings over which the noise is averaged
BENT = 6.0  # variance of a second difference of white noise of variance 1
WORTH = 0.51  # independent squares in each of them: neighbours share readings (correlations of -2/3 and 1/6)
RISK = 1e-6  # probability that few readings tell less noise than there is


class EncoderNoise:
    """Learns from readings; ``still`` is the distance that needs no motion.

    Noise is measured by second differences of consecutive readings: steady motion has none, and an acceleration can only
    make the noise look larger. Few readings may tell too little: ``still`` counts on the upper limit of the variance that they leave possible.
    """

    def __init__(self, axes: int) -> None:
        self.count = np.full(axes, np.inf)  # m, the smallest change so far
        self.variance = np.zeros(axes)  # m^2 of one reading
        self._readings = 0
        self._last = np.empty((0, axes))

    def saw(self, values: FloatArray) -> None:
        """Consecutive positions, (n, axes) in m."""
        rows = np.concatenate((self._last, values))
        steps = np.abs(np.diff(rows, axis=0))
        if len(steps):
            self.count = np.minimum(self.count, np.min(np.where(steps > 0, steps, np.inf), axis=0))
        if len(rows) > 2:
            bent = np.diff(rows, 2, axis=0)
            self._readings = min(self._readings + len(bent), MEMORY)
            share = min(1.0, len(bent) / self._readings)
            self.variance += share * (np.mean(bent * bent, axis=0) / BENT - self.variance)
        self._last = rows[-2:]

    @property
    def still(self) -> FloatArray:
        """(axes,) m by which two readings differ at most while the axis rests."""
        squares = WORTH * self._readings
        least = 2.0 * float(scipy.special.gammaincinv(squares / 2.0, RISK)) if squares else 1.0  # of a sum of so many squares (chi-squared)
        sigma = np.sqrt(self.variance * max(squares / max(least, 1e-300), 1.0))
        return np.asarray(COUNTS * np.where(np.isfinite(self.count), self.count, 0.0) + SIGMAS * sigma)
