"""One stream of samples, kept by its counter modulo a capacity, so that blocks may come in any order.

A block that goes on where the last one ended, with nothing wrong about it, is laid in by one compiled loop: at 2 kHz in
blocks of 20 that is every block, a hundred times a second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from xy_sysid.compiled import compiled
from xy_sysid.errors import BadInput
from xy_sysid.recording import rate_from_time
from xy_sysid.stream import Block, FloatArray

RATE_SAMPLES = 200  # samples of one stream from which its rate is read

Counters = NDArray[np.int64]


class Ring:
    """The newest ``capacity`` samples of one stream.

    tag: (capacity,) the counter of the sample that lies there, -1 for none; value: (capacity, axes)
    newest: the highest counter heard, -1 before the first; rate: Hz, None until it is learnt
    offset: s, time of the newest sample less its counter over the rate
    behind, behind_next: how many blocks in a row came from the past, and the counter with which the next would go on
    """

    def __init__(self, capacity: int, axes: int) -> None:
        self.capacity = capacity
        self.tag: Counters = np.full(capacity, -1, dtype=np.int64)
        self.value: FloatArray = np.zeros((capacity, axes))
        self.newest = -1
        self.offset: float | None = None
        self.rate: float | None = None
        self.behind = 0
        self.behind_next = -1
        self._seqs: list[FloatArray] = []
        self._times: list[FloatArray] = []

    def follow(self, block: Block, least: int, tolerance: float) -> bool:
        """Lay in a block that begins right after the newest sample and has no fault; False, and nothing done, for any other.

        least: counter from which on samples are still wanted; tolerance: samples by which a time may leave its place
        """
        if self.rate is None or self.offset is None or block.values.shape != (len(block), self.value.shape[1]):
            return False
        first, end = self.newest + 1, self.newest + 1 + len(block)
        if len(block) == 0 or first < least or end > least + self.capacity:
            return False
        if not _faultless(block.seq, block.time, block.values, first, self.rate, self.offset, tolerance / self.rate):
            return False
        _lay(block.values, first, self.tag, self.value)
        self.newest, self.offset, self.behind = end - 1, float(block.time[-1] - (end - 1) / self.rate), 0
        return True

    def put(self, seq: Counters, values: FloatArray) -> int:
        """Store what is new; the number of samples that were there already."""
        place = seq % self.capacity
        fresh = self.tag[place] != seq
        if bool(fresh.all()):
            self.tag[place], self.value[place] = seq, values
        else:
            self.tag[place[fresh]], self.value[place[fresh]] = seq[fresh], values[fresh]
        if seq.size:
            self.newest = max(self.newest, int(seq[-1]))
        return int(seq.size - np.count_nonzero(fresh))

    def filled(self, first: int, last: int) -> NDArray[np.bool_]:
        """(last - first,) whether each counter is there."""
        seq = np.arange(first, last)
        return np.asarray(self.tag[seq % self.capacity] == seq, dtype=np.bool_)

    def take(self, first: int, last: int) -> FloatArray:
        """(last - first, axes) a copy of what lies there."""
        begin = first % self.capacity
        end = begin + last - first
        if end <= self.capacity:
            return self.value[begin:end].copy()
        return np.concatenate((self.value[begin:], self.value[: end - self.capacity]))

    def clear(self) -> None:
        """Forget the samples, not the rate."""
        self.tag.fill(-1)
        self.newest, self.offset, self.behind = -1, None, 0

    def learn_rate(self, block: Block) -> None:
        """Read the rate from the first samples."""
        if self.rate is None:
            self._seqs.append(block.seq.copy())
            self._times.append(block.time.copy())
            if sum(map(len, self._seqs)) >= RATE_SAMPLES:
                seq, time = np.concatenate(self._seqs), np.concatenate(self._times)
                order = np.argsort(seq, kind="stable")
                keep = order[np.concatenate(([True], np.diff(seq[order]) > 0))]
                self._seqs, self._times = [], []
                try:
                    self.rate = rate_from_time(time[keep], seq[keep].astype(np.int64))
                except BadInput:
                    self.rate = None


def shared(one: Ring, other: Ring, first: int, last: int) -> int:
    """How many samples from counter ``first`` on, at the most to ``last``, both rings hold without a hole."""
    return int(_shared(one.tag, other.tag, first, last))


@compiled
def _faultless(seq: FloatArray, time: FloatArray, values: FloatArray, first: int, rate: float, offset: float, tolerance: float) -> bool:
    """Whether the counter goes on by ones from ``first``, the time with it, and every value is a number."""
    before = offset
    for i in range(seq.shape[0]):
        now = time[i] - seq[i] / rate
        if not (seq[i] == first + i and abs(now - before) <= tolerance):
            return False
        before = now
        for k in range(values.shape[1]):
            if not np.isfinite(values[i, k]):
                return False
    return True


@compiled
def _lay(values: FloatArray, first: int, tag: Counters, store: FloatArray) -> None:
    place = first % tag.shape[0]
    for i in range(values.shape[0]):
        tag[place] = first + i
        for k in range(values.shape[1]):
            store[place, k] = values[i, k]
        place = place + 1 if place + 1 < tag.shape[0] else 0


@compiled
def _shared(one: Counters, other: Counters, first: int, last: int) -> int:
    place = first % one.shape[0]
    for seq in range(first, last):
        if one[place] != seq or other[place] != seq:
            return seq - first
        place = place + 1 if place + 1 < one.shape[0] else 0
    return last - first
