"""Numbers and even instants for samples with a stamp and no counter: stamps jitter, samples are lost, and both look equal at first.

A cycle that began late is followed by short ones until the stamps are in time again; after a lost sample all the following stamps are
late. So a late sample waits until the stamps are in time again (then none was lost) or have stayed late (then that many were lost).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

LATE = 0.5  # periods after its expected time from which a sample is late
PATIENCE = 25  # consecutive samples late by the same number of periods after which that many count as lost
LONGEST = 2000  # most waiting samples
FOLLOW = 0.1  # part of a sample's lateness by which the grid is shifted, so that a small error of the period does not matter
SETTLED = 1000.0  # samples over which the period is estimated


@dataclass(frozen=True, slots=True)
class Numbered:
    """Samples that are decided, in order; the oldest undecided ones first.

    number: (n,) of each; instant: (n,) s, on the even grid; at: (n,) index of the stamp at which each was decided
    used:   (stamps,) False for stamps that are left out
    """

    number: NDArray[np.int64]
    instant: FloatArray
    at: NDArray[np.int64]
    used: NDArray[np.bool_]


class StampCounter:
    """Numbers samples by their stamps; the first is 0. A stamp that is not after the one before is left out."""

    def __init__(self, period: float) -> None:
        """period: s, first estimate; it is adapted to the stamps."""
        self.period = period
        self._number, self._count = -1, 0  # of the newest decided sample; of waiting ones
        self._instant = 0.0  # of the newest decided sample, s, on the even grid
        self._stamp = 0.0  # of the same sample, s
        self._waiting = np.empty(LONGEST)

    def feed(self, times: FloatArray) -> Numbered:
        """Add stamps, s, all finite; the result is the same for any division into calls."""
        state = self._number, self._instant, self._stamp, self.period, self._count
        state, number, instant, at, used = _feed(times, *state, self._waiting)
        self._number, self._instant, self._stamp, self.period, self._count = state
        return Numbered(number, instant, at, used)


@compiled
def _feed(
    times: NDArray[np.float64], newest: int, even: float, stamp: float, period: float, count: int, waiting: NDArray[np.float64]
) -> tuple[
    tuple[int, float, float, float, int], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]
]:  # fmt: skip
    """((newest, even, stamp, period, count), numbers, instants, at, used); see ``StampCounter`` and ``Numbered``."""
    number, instant = np.empty(count + times.shape[0], np.int64), np.empty(count + times.shape[0])
    at, used = np.empty(count + times.shape[0], np.int64), np.zeros(times.shape[0], np.bool_)
    done = 0
    for i in range(times.shape[0]):
        time = times[i]
        if newest < 0 and count == 0:
            newest, even, stamp, used[i] = 0, time, time, True
            number[done], instant[done], at[done] = 0, time, i
            done += 1
            continue
        if time <= (waiting[count - 1] if count else stamp):
            continue
        used[i], waiting[count] = True, time
        count += 1
        lost = 0
        if (time - even) / period - count > LATE:
            if count < PATIENCE:
                continue
            lately = np.empty(PATIENCE)  # periods by which each of the newest waiting samples is late if none was lost
            for k in range(PATIENCE):
                place = count - PATIENCE + k
                lately[k] = (waiting[place] - even) / period - (place + 1)
            lately.sort()
            if not lately[-1] - lately[0] < 1.0 and count < LONGEST:
                continue
            lost = int(np.rint(lately[PATIENCE // 2]))  # the median
        newest += lost
        even += lost * period
        for k in range(count):
            newest += 1
            even += period
            off = waiting[k] - even
            if abs(off) <= LATE * period:  # the stamp of a late cycle does not show its expected time
                even += FOLLOW * off
                period += FOLLOW * off / SETTLED
            elif off < 0:  # no sample is early: too many were counted as lost
                even = waiting[k] + LATE * period
            number[done], instant[done], at[done] = newest, even, i
            done += 1
        stamp, count = waiting[count - 1], 0
    return (newest, even, stamp, period, count), number[:done], instant[:done], at[:done], used
