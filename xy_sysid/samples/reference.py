"""Assigns the controller's reference to paired samples by its time stamps.

Each sample gets the newest reference that was sent up to its instant. The reference is an instrument: a constant lead, or a sample with
its neighbour's reference, has the same effect on input and output, and cancels in their quotient
(Söderström & Stoica, Instrumental variable methods, 1983, sec. 3.1).
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from xy_sysid.samples.block import Block, FloatArray, Samples
from xy_sysid.samples.pairing import Gap

NO_REFERENCE = "no_reference"


class ReferenceHold:
    """``hear`` reads blocks of the reference, ``take`` reads paired samples and gaps; both return the samples that are complete, in order.

    A sample is complete when a reference of its instant or later has arrived. It becomes a gap if it is older than the newest samples by more than
    the allowed delay of a reference, or if its newest reference is older than that.
    """

    def __init__(self, axes: tuple[str, ...], late: float) -> None:
        """axes: of the samples; late: maximum delay of a reference in s, and the time for which it stays valid."""
        self.counts: Counter[str] = Counter()
        self.said: dict[str, str] = {}
        self.newest = -1
        self._axes, self._late = axes, late
        self._time: FloatArray = np.empty(0)
        self._value: FloatArray = np.empty((0, len(axes)))
        self._waiting: deque[Samples | Gap] = deque()
        self._latest = -np.inf

    def hear(self, block: Block) -> list[Samples | Gap]:
        """Read a block of the reference; blocks may have any length."""
        if any(axis not in block.axes for axis in self._axes) or block.values.shape != (len(block), len(block.axes)):
            self._fault("wrong_columns", f"reference: columns {', '.join(block.axes)}; expected {', '.join(self._axes)}")
            return []
        values = block.values[:, [block.axes.index(axis) for axis in self._axes]]
        good = np.isfinite(block.time) & np.isfinite(values).all(axis=1)
        if not bool(good.all()):
            self._fault("not_finite", f"reference: {int(np.sum(~good))} samples are not finite", int(np.sum(~good)))
        time, values = block.time[good], values[good]
        if time.size == 0:
            return []
        self.newest = int(block.seq[good][-1]) if np.isfinite(block.seq[good][-1]) else self.newest
        if self._time.size and float(time[0]) < float(self._time[-1]) - self._late:
            self._fault("restart", f"reference: its time went back by {self._time[-1] - time[0]:.6g} s")
            self._time, self._value = np.empty(0), np.empty((0, len(self._axes)))
        order = np.argsort(joined := np.concatenate((self._time, time)), kind="stable")
        self._time, self._value = joined[order], np.concatenate((self._value, values))[order]
        return self._decided()

    def take(self, event: Samples | Gap) -> list[Samples | Gap]:
        """Read the output of the pairing; samples need their stamps."""
        self._waiting.append(event)
        if isinstance(event, Samples) and event.time is not None and len(event):
            self._latest = float(event.time[0])  # of its first sample, so that a long block also waits for its reference
        return self._decided()

    def _decided(self) -> list[Samples | Gap]:
        found: list[Samples | Gap] = []
        newest = float(self._time[-1]) if self._time.size else -np.inf
        until = max(newest, self._latest - self._late)
        while self._waiting:
            event = self._waiting[0]
            if isinstance(event, Gap):
                found.append(event)
                self._waiting.popleft()
                continue
            time = np.full(len(event), np.inf) if event.time is None else np.maximum.accumulate(event.time)
            ready = int(np.searchsorted(time, until, side="right"))
            found += self._laid(event.rows(0, ready), time[:ready])
            if ready < len(event):
                self._waiting[0] = event.rows(ready, len(event))
                break
            self._waiting.popleft()
        self._forget()
        return found

    def _laid(self, samples: Samples, time: FloatArray) -> list[Samples | Gap]:
        """Runs with a reference, and the gaps between them."""
        place = np.searchsorted(self._time, time, side="right") - 1
        there: NDArray[np.bool_] = place >= 0
        there[there] = time[there] - self._time[place[there]] <= self._late
        edges = np.flatnonzero(np.diff(there)) + 1
        found: list[Samples | Gap] = []
        for first, last in zip((0, *edges.tolist()), (*edges.tolist(), len(samples)), strict=True):
            if last > first and there[first]:
                found.append(replace(samples.rows(first, last), reference=self._value[place[first:last]]))
            elif last > first:
                self._fault(NO_REFERENCE, f"no reference for {last - first} samples from counter {samples.seq + first} on", last - first)
                found.append(Gap(samples.seq + first, last - first, NO_REFERENCE))
        return found

    def _forget(self) -> None:
        """Drop references that no sample needs any more."""
        first = self._waiting[0] if self._waiting else None
        oldest = float(first.time[0]) if isinstance(first, Samples) and first.time is not None else self._latest
        keep = max(int(np.searchsorted(self._time, oldest - self._late)), 0)
        self._time, self._value = self._time[keep:], self._value[keep:]

    def _fault(self, reason: str, text: str, number: int = 1) -> None:
        self.counts[reason] += number
        self.said[reason] = text
