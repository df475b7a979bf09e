"""Numbers for samples that carry a stamp and no counter, and even instants: stamps jitter, samples get lost, and both look alike at first.

A cycle that began late is followed by short ones until the clock is caught up with; a sample that was lost leaves all that
follow late. So a late sample waits until the stamps are back in time (then none was lost) or have stayed late (then so many were).
"""

from __future__ import annotations

import numpy as np

LATE = 0.5  # periods after its time from which a sample is late
PATIENCE = 25  # samples that must be late by the same number of periods before so many count as lost
LONGEST = 2000  # samples that wait for that at the most
FOLLOW = 0.1  # part of a sample's lateness that its successors take over, so that a period that is a little off does no harm
SETTLED = 1000.0  # samples over which the period is learnt


class StampCounter:
    """add(time) -> (number, instant) of each sample that is decided now, in order, or None if this one is left out; the first is 0."""

    def __init__(self, period: float) -> None:
        """period: s, as far as it is known; it is followed from there."""
        self.period = period
        self.number = -1
        self._instant = 0.0  # of the newest sample that is decided, s, even
        self._stamp = 0.0  # of the same
        self._waiting: list[float] = []

    def add(self, time: float) -> list[tuple[int, float]] | None:
        """One stamp, s; one that is not after the one before is left out: None."""
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
        """(waiting,) periods by which each is after its time if none was lost."""
        times = np.array(self._waiting)
        return np.asarray((times - self._instant) / self.period - np.arange(1, len(times) + 1))

    def _decide(self, lost: int) -> list[tuple[int, float]]:
        """Number those that wait, ``lost`` of them missing before the first."""
        found = []
        self.number += lost
        self._instant += lost * self.period
        for time in self._waiting:
            self.number += 1
            self._instant += self.period
            off = time - self._instant
            if abs(off) <= LATE * self.period:  # a late cycle says nothing of when it should have been
                self._instant += FOLLOW * off
                self.period += FOLLOW * off / SETTLED
            elif off < 0:  # nothing comes before its time: too many were counted as lost
                self._instant = time + LATE * self.period
            found.append((self.number, self._instant))
        self._stamp = self._waiting[-1]
        self._waiting.clear()
        return found
