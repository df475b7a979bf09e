"""One stream of samples, stored by its counter modulo a capacity, so that blocks may arrive in any order.

A block without a fault that continues the previous one is stored by one compiled loop: this is the usual case, a hundred times a
second at 2 kHz in blocks of 20.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.recording import rate_from_time

RATE_SAMPLES = 200  # samples of one stream for the estimate of its rate
DRIFT = 0.01  # of a period per sample, over DRIFT_SECONDS: above this the rate has changed
DRIFT_SECONDS, DRIFT_SAMPLES = 5.0, 10 * RATE_SAMPLES  # the shorter of the two is used

Counters = NDArray[np.int64]


class Ring:
    """The newest ``capacity`` samples of one stream.

    tag: (capacity,) the counter of the stored sample, -1 for none; value: (capacity, axes); time: (capacity,) stamps, s
    newest: the highest counter, -1 before the first; rate: Hz, None until it is estimated
    offset: s, time of the newest sample minus its counter over the rate
    behind, behind_next: number of consecutive old blocks, and the counter with which the next would continue
    jumping: number of consecutive samples whose time does not match their counter
    """

    def __init__(self, capacity: int, axes: int) -> None:
        self.capacity = capacity
        self.tag: Counters = np.full(capacity, -1, dtype=np.int64)
        self.value: FloatArray = np.zeros((capacity, axes))
        self.time: FloatArray = np.zeros(capacity)
        self.newest = -1
        self.offset: float | None = None
        self.rate: float | None = None
        self.behind = 0
        self.behind_next = -1
        self.jumping = 0
        self._anchor: tuple[int, float] | None = None  # counter and offset from which the time must follow the rate
        self._seqs: list[FloatArray] = []
        self._times: list[FloatArray] = []

    def follow(self, block: Block, least: int, tolerance: float) -> bool:
        """Store a block that continues the newest sample and has no fault; for any other block return False without a change.

        least: lowest counter that is still needed; tolerance: samples by which a time may deviate
        """
        if self.rate is None or self.offset is None or block.values.shape != (len(block), self.value.shape[1]):
            return False
        first, end = self.newest + 1, self.newest + 1 + len(block)
        if len(block) == 0 or first < least or end > least + self.capacity:
            return False
        if not _faultless(block.seq, block.time, block.values, first, self.rate, self.offset, tolerance / self.rate):
            return False
        _lay((block.values, block.time), first, self.tag, (self.value, self.time))
        self.newest, self.offset, self.behind = end - 1, float(block.time[-1] - (end - 1) / self.rate), 0
        self.jumping = 0
        return True

    def jumped(self) -> None:
        """The following samples are on another line of the same rate."""
        self._anchor = None

    def left_its_rate(self) -> bool:
        """True if the time has drifted from the learned rate, although no stamp jumped."""
        if self.rate is None or self.offset is None:
            return False
        if self._anchor is None:
            self._anchor = self.newest, self.offset
            return False
        counter, offset = self._anchor
        span = self.newest - counter
        enough = min(max(round(DRIFT_SECONDS * self.rate), RATE_SAMPLES), DRIFT_SAMPLES)
        if abs(self.offset - offset) * self.rate > DRIFT * max(span, enough):
            return True
        if span > enough:
            self._anchor = self.newest, self.offset
        return False

    def put(self, seq: Counters, values: FloatArray, time: FloatArray) -> int:
        """Store new samples; returns the number of samples that were already there."""
        place = seq % self.capacity
        fresh = self.tag[place] != seq
        if bool(fresh.all()):
            self.tag[place], self.value[place], self.time[place] = seq, values, time
        else:
            self.tag[place[fresh]], self.value[place[fresh]], self.time[place[fresh]] = seq[fresh], values[fresh], time[fresh]
        if seq.size:
            self.newest = max(self.newest, int(seq[-1]))
        return int(seq.size - np.count_nonzero(fresh))

    def filled(self, first: int, last: int) -> NDArray[np.bool_]:
        """(last - first,) True for each stored counter."""
        seq = np.arange(first, last)
        return np.asarray(self.tag[seq % self.capacity] == seq, dtype=np.bool_)

    def take(self, first: int, last: int) -> FloatArray:
        """(last - first, axes) a copy of the stored values."""
        return self._copy(self.value, first, last)

    def stamps(self, first: int, last: int) -> FloatArray:
        """(last - first,) a copy of the stored stamps, s."""
        return self._copy(self.time, first, last)

    def _copy(self, store: FloatArray, first: int, last: int) -> FloatArray:
        begin = first % self.capacity
        end = begin + last - first
        if end <= self.capacity:
            return store[begin:end].copy()
        return np.concatenate((store[begin:], store[: end - self.capacity]))

    def clear(self) -> None:
        """Delete everything including the rate: a source that restarts may be another one."""
        self.tag.fill(-1)
        self.newest, self.offset, self.behind, self.jumping, self._anchor = -1, None, 0, 0, None
        self.rate, self._seqs, self._times = None, [], []

    def learn_rate(self, block: Block) -> None:
        """Estimate the rate from the first samples."""
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
    """Number of consecutive samples from counter ``first`` to before ``last`` that both rings have."""
    return int(_shared(one.tag, other.tag, first, last))


@compiled
def _faultless(seq: FloatArray, time: FloatArray, values: FloatArray, first: int, rate: float, offset: float, tolerance: float) -> bool:
    """Whether the counter increases by 1 from ``first``, the time follows it, and every value is finite."""
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
def _lay(rows: tuple[FloatArray, FloatArray], first: int, tag: Counters, stores: tuple[FloatArray, FloatArray]) -> None:
    (values, time), (store, stamps) = rows, stores
    place = first % tag.shape[0]
    for i in range(values.shape[0]):
        tag[place] = first + i
        stamps[place] = time[i]
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
