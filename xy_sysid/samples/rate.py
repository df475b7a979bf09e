"""The sampling rate from all stamps so far: a straight line through them by least squares, with its standard error.

Stamps jitter, and neighbours are correlated (one late cycle delays the next ones). Therefore the line is fitted to means of BATCH
samples, and their scatter gives the error. The same samples give the same result bit for bit, in any chunking.
Source: Draper & Smith, Applied Regression Analysis, 3rd ed., ch. 1; batch means: Law, Simulation Modeling and Analysis, 9.5.3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import rate_from_time, whole_rate

BATCH = 50  # samples of one mean
JUMP = 1.5  # periods by which a stamp may deviate from the previous one, as in the live nodes
FEWEST = 4  # means needed to estimate an error and a first period
LEAP, STEP, ASIDE = 0.5, 0.75, 10  # a counter slip: one sample jumps by LEAP periods, and the means of ASIDE samples before and after differ by STEP


class StampLine:
    """Call add(first, stamps), cut() where the stamps leave their line, until(counter), then read ``rate`` and ``error``."""

    def __init__(self) -> None:
        self._known: tuple[float, float] | None = None  # rate and relative error of earlier stretches
        self._begin()

    def _begin(self) -> None:
        self._seq: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._time: FloatArray = np.zeros(0)
        self._origin: tuple[int, float, float] | None = None  # counter, stamp and period for residuals
        self._sums = np.zeros(6)
        self._waiting: tuple[float, FloatArray] | None = None  # the newest batch, which counts after a check for a slip at its end

    def add(self, first: int, stamps: FloatArray) -> None:
        """Stamps, s, of consecutive samples from counter ``first`` on."""
        self._seq = np.concatenate((self._seq, np.arange(first, first + stamps.size)))
        self._time = np.concatenate((self._time, stamps))

    def until(self, counter: int) -> None:
        """Use complete batches of the samples before this counter."""
        whole = int(np.searchsorted(self._seq, counter)) // BATCH * BATCH
        if whole == 0 or (self._origin is None and whole < FEWEST * BATCH):
            return
        seq, time = self._seq[:whole], self._time[:whole]
        self._seq, self._time = self._seq[whole:], self._time[whole:]
        if self._origin is None:
            try:
                period = 1.0 / rate_from_time(time[: FEWEST * BATCH], seq[: FEWEST * BATCH])
            except BadInput:
                return
            self._origin = int(seq[0]), float(time[0]), period
        begin, instant, period = self._origin
        place = (seq - begin).astype(np.float64)
        off = (time - instant) - place * period
        self._take(place.reshape(-1, BATCH).mean(axis=1), off.reshape(-1, BATCH) / period)

    def _take(self, x: FloatArray, rows: FloatArray) -> None:
        """Add batches (n,), (n, BATCH), in periods off the line. After a slip in one, or at the end of the previous one, neither counts and a new
        stretch starts."""
        if self._waiting is not None:
            x, rows = np.concatenate(([self._waiting[0]], x)), np.concatenate((self._waiting[1][None], rows))
        slipped, means, waiting = _slips(rows), rows.mean(axis=1).tolist(), True
        for k, bad in enumerate(slipped.tolist()):
            if not waiting:
                waiting = True  # the previous batch does not belong to a pair
            elif bad:
                self._known, self._sums, waiting = self._both(), np.zeros(6), False
            else:
                _grow(self._sums, float(x[k]), means[k])
        self._waiting = (float(x[-1]), rows[-1]) if waiting else None

    def cut(self) -> None:
        """The following stamps are on another line of the same rate: keep the estimate of the rate."""
        found = self._both()
        self._begin()
        self._known = found

    def start(self, rate: float, error: float) -> None:
        """Continue from the estimate before a restart."""
        self._known = (rate, error)

    @property
    def rate(self) -> float | None:
        """Hz, None while unknown; a rate within 20 ppm of an integer is that integer."""
        found = self._both()
        return None if found is None else whole_rate(found[0])

    @property
    def error(self) -> float:
        """Standard error of the rate, relative; 0 while unknown."""
        found = self._both()
        return 0.0 if found is None else found[1]

    def _both(self) -> tuple[float, float] | None:
        """(rate, error) of this stretch and the earlier ones, weighted by their errors."""
        now, before = self._now(), self._known
        if now is None or before is None:
            return now or before
        if before[1] == 0.0 or now[1] == 0.0:
            return before if before[1] == 0.0 else now
        weights = now[1] ** -2, before[1] ** -2
        return (weights[0] * now[0] + weights[1] * before[0]) / sum(weights), sum(weights) ** -0.5

    def _now(self) -> tuple[float, float] | None:
        count, _, _, spread, along, across = self._sums.tolist()
        if count < FEWEST or self._origin is None:
            return None
        slope = along / spread
        left = max(across - slope * along, 0.0) / (count - 2.0)
        return 1.0 / (self._origin[2] * (1.0 + slope)), math.sqrt(left / spread) / (1.0 + slope)


def error_of_rate(time: FloatArray, seq: NDArray[np.int64]) -> float:
    """Relative standard error of the rate of a whole recording; 0 for even or few stamps."""
    line = StampLine()
    try:
        period = 1.0 / rate_from_time(time, seq)
    except BadInput:
        return 0.0
    jumps = np.flatnonzero(np.abs(np.diff(time) - np.diff(seq) * period) > JUMP * period) + 1
    for start, stop in zip([0, *jumps.tolist()], [*jumps.tolist(), len(seq)], strict=True):
        line.cut()
        for piece in np.split(np.arange(start, stop), np.flatnonzero(np.diff(seq[start:stop]) > 1) + 1):
            line.add(int(seq[piece[0]]), time[piece])
        line.until(int(seq[stop - 1]) + 1)
    return line.error


def _slips(rows: FloatArray) -> NDArray[np.bool_]:
    """(n - 1,) True if the counter slipped in a batch, or at the end of the previous one; rows: (n, BATCH) periods off."""
    both = np.concatenate((rows[:-1], rows[1:]), axis=1)
    at = np.arange(BATCH - ASIDE + 1, 2 * BATCH - ASIDE + 1)
    sums = np.concatenate((np.zeros((len(both), 1)), np.cumsum(both, axis=1)), axis=1)
    after, ahead = sums[:, at + ASIDE] - sums[:, at], sums[:, at] - sums[:, at - ASIDE]
    leaps = np.abs(both[:, at] - both[:, at - 1]) > LEAP
    return np.asarray(np.any(leaps & (np.abs(after - ahead) > ASIDE * STEP), axis=1))


@compiled
def _grow(sums: FloatArray, x: float, y: float) -> None:
    """Update number, means and centred sums of (x, y) with one more pair (Welford, Technometrics 4, 1962)."""
    sums[0] += 1.0
    dx, dy = x - sums[1], y - sums[2]
    sums[1] += dx / sums[0]
    sums[2] += dy / sums[0]
    sums[3] += dx * (x - sums[1])
    sums[4] += dx * (y - sums[2])
    sums[5] += dy * (y - sums[2])
