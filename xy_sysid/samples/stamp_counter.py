"""Numbers and even instants for samples with a stamp and no counter: stamps jitter, samples are lost, and both look equal at first.

A cycle that began late is followed by short ones until the stamps are in time again; after a lost sample all the following stamps are
late. So a late sample waits until the stamps are in time again (then none was lost) or have stayed late (then that many were lost).
"""

from __future__ import annotations

import numpy as np

LATE = 0.5  # periods after its expected time from which a sample is late
PATIENCE = 25  # consecutive samples late by the same number of periods after which that many count as lost
LONGEST = 2000  # most waiting samples
FOLLOW = 0.1  # part of a sample's lateness by which the grid is shifted, so that a small error of the period does not matter
SETTLED = 1000.0  # samples over which the period is estimated


class StampCounter:
    """add(time) -> (number, instant, s) of each sample that is decided now, in order, or None if this one is left out; the first is 0."""

    def __init__(self, period: float) -> None:
        """period: s, first estimate; it is adapted to the stamps."""
        self.period = period
        self.number = -1
        self._instant = 0.0  # of the newest decided sample, s, on the even grid
        self._stamp = 0.0  # of the same sample, s
        self._waiting: list[float] = []

    def add(self, time: float) -> list[tuple[int, float]] | None:
        """Add one stamp, s; returns None for a stamp that is not after the one before, which is left out."""
        before = self._waiting[-1] if self._waiting else self._stamp
        if self.number < 0 and not self._waiting:
            self.number, self._instant, self._stamp = 0, time, time
            return [(0, time)]
        if time <= before:
            return None
        self._waiting.append(time)
        late = self._late()
        if late[-1] <= LATE:
            return self._decide(0)
        lately = late[-PATIENCE:]
        if (len(late) >= PATIENCE and np.ptp(lately) < 1.0) or len(late) >= LONGEST:
            return self._decide(round(float(np.median(lately))))
        return []

    def _late(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """(waiting,) periods by which each waiting sample is late if none was lost."""
        times = np.array(self._waiting)
        return np.asarray((times - self._instant) / self.period - np.arange(1, len(times) + 1))

    def _decide(self, lost: int) -> list[tuple[int, float]]:
        """Number the waiting samples after ``lost`` missing ones."""
        found = []
        self.number += lost
        self._instant += lost * self.period
        for time in self._waiting:
            self.number += 1
            self._instant += self.period
            off = time - self._instant
            if abs(off) <= LATE * self.period:  # the stamp of a late cycle does not show its expected time
                self._instant += FOLLOW * off
                self.period += FOLLOW * off / SETTLED
            elif off < 0:  # no sample is early: too many were counted as lost
                self._instant = time + LATE * self.period
            found.append((self.number, self._instant))
        self._stamp = self._waiting[-1]
        self._waiting.clear()
        return found
