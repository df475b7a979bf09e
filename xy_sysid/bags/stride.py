"""From raw messages to arrays without deserializing each: check that the layout is constant, then copy at fixed offsets.

Messages are read in log order. A stretch of messages with equal length and the fixed bytes of the first is copied at
once; a change of the layout begins a new stretch, so a mixture needs one parse per change, and the worst case
is one parse per message.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.bags.cdr import Bytes, Layout, Unreadable
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Batch:
    """Raw messages in log order.

    topic:    (n,) index into the list of requested topics
    log_time: (n,) ns
    start:    (n,) offset of each message in ``buffer``
    length:   (n,) length of each message in bytes
    buffer:   the bytes; the next batch reuses it, so copy data to keep
    """

    topic: Indices
    log_time: Indices
    start: Indices
    length: Indices
    buffer: Bytes


@dataclass(frozen=True, slots=True)
class Stretch:
    """Messages ``first`` to ``last`` (exclusive) of one layout; ``layout`` is None for an unreadable message."""

    first: int
    last: int
    layout: Layout | None


@compiled
def same_layout(buffer: Bytes, start: Indices, length: Indices, first: int, last: int, template: Bytes, fixed: Bytes) -> int:
    """End of the stretch from ``first`` whose lengths and fixed bytes equal the template's, at most ``last``."""
    size, used = template.shape[0], fixed.shape[0]
    for row in range(first, last):
        if length[row] != size:
            return row
        message = buffer[start[row] : start[row] + used]
        differs = np.uint8(0)
        for index in range(used):  # without an early exit the compiler takes 32 bytes at a time
            differs |= (message[index] ^ template[index]) & fixed[index]
        if differs != 0:
            return row
    return last


@compiled
def copy_parts(buffer: Bytes, start: Indices, first: int, last: int, offset: int, out: Bytes) -> None:
    """``out[i]`` = the bytes at ``offset`` of message ``first + i``."""
    count = out.shape[1]
    for row in range(first, last):
        source = buffer[start[row] + offset : start[row] + offset + count]
        target = out[row - first]
        for index in range(count):
            target[index] = source[index]


class Reader:
    """Decodes one topic, batch after batch; remembers the last layout, so that a constant one is parsed once."""

    def __init__(self, parse: Callable[[bytes], Layout]) -> None:
        self.parse = parse
        self.layout: Layout | None = None
        self.used = np.empty(0, np.uint8)

    def stretches(self, batch: Batch) -> Iterator[Stretch]:
        """The batch, divided where the layout changes; all its messages must be of this topic."""
        first, count = 0, int(batch.start.shape[0])
        while first < count:
            last = first
            if self.layout is not None:
                last = same_layout(batch.buffer, batch.start, batch.length, first, count, self.layout.template, self.used)
            if last == first:
                message = batch.buffer[batch.start[first] : batch.start[first] + batch.length[first]].tobytes()
                try:
                    self.layout = self.parse(message)
                except Unreadable:
                    self.layout = None
                    yield Stretch(first, first + 1, None)
                    first += 1
                    continue
                self.used = self.layout.fixed[: int(np.flatnonzero(self.layout.fixed)[-1]) + 1]
                continue
            yield Stretch(first, last, self.layout)
            first = last


def doubles(batch: Batch, stretch: Stretch, part: int) -> FloatArray:
    """(messages, count) numbers of one part of every message in the stretch."""
    layout = stretch.layout
    assert layout is not None
    offset, count = layout.parts[part]
    out = np.empty((stretch.last - stretch.first, count), np.float64)
    copy_parts(batch.buffer, batch.start, stretch.first, stretch.last, offset, out.view(np.uint8).reshape(len(out), 8 * count))
    return out if layout.order == "<" else out.byteswap()


def stamps(batch: Batch, stretch: Stretch) -> Indices:
    """(messages,) header stamps, ns; the log time if a stamp is zero."""
    layout = stretch.layout
    assert layout is not None
    raw = np.empty((stretch.last - stretch.first, 8), np.uint8)
    copy_parts(batch.buffer, batch.start, stretch.first, stretch.last, layout.stamp, raw)
    seconds = raw[:, :4].copy().view(layout.order + "i4")[:, 0].astype(np.int64)
    nanoseconds = raw[:, 4:].copy().view(layout.order + "u4")[:, 0].astype(np.int64)
    return seconds * 1_000_000_000 + nanoseconds
