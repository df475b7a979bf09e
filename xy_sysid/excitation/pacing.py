"""The time at which the next block is due: by the clock, or by the machine's answers. Time and answers are arguments."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from xy_sysid.samples.block import Block

CATCH_UP = 3  # most late blocks that are sent at once; after a longer stall time is skipped


@dataclass(slots=True)
class Clock:
    """Block k is due at start + k * period, s of a monotonic clock; period 0 is always due.

    late: number of blocks that were sent more than a period late, or skipped
    """

    period: float
    start: float
    sent: int = 0
    late: int = 0

    def due(self, now: float) -> int:
        """Number of blocks that are due and not sent yet; now: s."""
        if self.period == 0:
            return 1
        return max(0, int((now - self.start) / self.period) + 1 - self.sent)

    def skip(self, now: float) -> int:
        """Number of blocks of time to skip after a stall of at least CATCH_UP blocks, to avoid a burst; 0 without one."""
        behind = self.due(now) - 1
        if self.period == 0 or behind < CATCH_UP:
            return 0
        self.sent += behind
        self.late += behind
        return behind

    def slip(self, now: float) -> None:
        """Move the start so that at most one block is due, for a stream that must not skip."""
        behind = self.due(now) - 1
        if self.period > 0 and behind > 0:
            self.start += behind * self.period

    def count(self, now: float) -> None:
        """Count one sent block."""
        if self.due(now) > 1:
            self.late += 1
        self.sent += 1


@dataclass(slots=True)
class Answers:
    """Received positions, returned up to a sample: in lockstep no later position may be used."""

    _given: float = -1.0
    _blocks: deque[Block] = field(default_factory=deque)

    def add(self, block: Block) -> None:
        """Add received positions; those with a counter that is not finite, or was returned before, are ignored."""
        if len(block) and np.isfinite(block.seq).all() and block.seq[-1] > self._given:
            self._blocks.append(block)

    def up_to(self, seq: float) -> Block | None:
        """Rows not returned yet with a counter up to ``seq``; None until the machine has reached it."""
        if not self._blocks or self._blocks[-1].seq[-1] < seq:
            return None
        taken = [_rows(self._blocks[0], slice(0, 0))]
        while self._blocks and self._blocks[0].seq[0] <= seq:
            block = self._blocks.popleft()
            rows = int(np.searchsorted(block.seq, seq, side="right"))
            taken.append(_rows(block, slice(None, rows)))
            if rows < len(block):
                self._blocks.appendleft(_rows(block, slice(rows, None)))
        self._given = seq
        return Block(
            taken[0].axes,
            np.concatenate([block.seq for block in taken]),
            np.concatenate([block.time for block in taken]),
            np.concatenate([block.values for block in taken]),
        )


def _rows(block: Block, rows: slice) -> Block:
    return Block(block.axes, block.seq[rows], block.time[rows], block.values[rows])
