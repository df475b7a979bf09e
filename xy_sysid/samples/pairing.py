"""Pairs voltage and position by sample counter, in any order of arrival, and reports faults of the streams.

Both streams are stored in rings indexed by the counter. Samples in both rings are returned, in order. Samples that are missing for
longer than the reorder time become a gap.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from xy_sysid.samples.block import Block, FloatArray, Samples
from xy_sysid.samples.ring import RATE_SAMPLES, Ring, shared

Quantity = Literal["voltage", "position"]
QUANTITIES: tuple[Quantity, Quantity] = ("voltage", "position")

LOOK_AGAIN = 5 * RATE_SAMPLES  # blocks of unequal rates after which both are estimated again
RATE_TOLERANCE = 1e-3  # relative difference up to which two streams, or a stream before and after a restart, have the same rate
TIME_TOLERANCE = 1.5  # samples by which a time stamp may deviate without a jump
REORDER_UNKNOWN = 1000  # samples by which a block may be late while the rate is unknown
RESTART_BLOCKS = 2  # consecutive old blocks that count as a restart of the source

REASONS = {
    "lost": "samples never came",
    "not_finite": "a value was NaN or infinite",
    "time_jump": "time jumped against the sample counter",
    "restart": "a source started again",
    "overrun": "one stream was silent while the other went on",
    "duplicated": "samples came twice (the first is kept)",
    "late": "samples came after they had been given up",
    "wrong_columns": "a message did not hold the expected columns",
    "bad_counter": "the sample counter was not whole and increasing",
    "unequal_rates": "voltage and position have different sampling rates",
    "no_reference": "no reference of the controller was received at that time",
}


@dataclass(frozen=True, slots=True)
class Gap:
    """Missing samples: ``seq`` is the counter of the first; their number and the reason (a key of REASONS) follow."""

    seq: int
    samples: int
    reason: str


class Pairer:
    """feed(kind, block) -> paired samples and gaps, in order of the counter."""

    def __init__(self, axes: tuple[str, ...], reorder: float, capacity: int = 1 << 15) -> None:
        """reorder: s by which a block may be late; capacity: samples by which one stream may be ahead of the other."""
        self.axes = axes
        self.counts: Counter[str] = Counter()
        self.said: dict[str, str] = {}
        self._reorder_time = reorder
        self._rings = {kind: Ring(capacity, len(axes)) for kind in QUANTITIES}
        self._next: int | None = None
        self._cuts: dict[int, str] = {}
        self._bad: dict[int, str] = {}

    @property
    def rate(self) -> float | None:
        """Sampling rate in Hz, from the position stream; None until enough samples have arrived."""
        return self._rings["position"].rate

    @property
    def _reorder(self) -> int:
        """Samples by which a block may be late."""
        most = self._rings["voltage"].capacity // 4
        return REORDER_UNKNOWN if self.rate is None else min(max(round(self._reorder_time * self.rate), 1), most)

    @property
    def waiting(self) -> dict[Quantity, int]:
        """Newest counter of each stream, -1 before the first sample."""
        return {kind: ring.newest for kind, ring in self._rings.items()}

    def feed(self, kind: Quantity, block: Block) -> list[Samples | Gap]:
        """Read one block of one stream; blocks may have any length."""
        step = self._rings[kind].capacity // 4
        if len(block) <= step:
            return self._feed(kind, block)
        found: list[Samples | Gap] = []
        for start in range(0, len(block), step):
            found += self._feed(kind, block.rows(start, start + step))
        return found

    def _feed(self, kind: Quantity, block: Block) -> list[Samples | Gap]:
        ring = self._rings[kind]
        if block.axes == self.axes and self._next is not None and ring.follow(block, self._next, TIME_TOLERANCE):
            return self._go_on(kind, ring)
        columns = self._columns(kind, block)
        if columns is None or len(block) == 0:
            return []
        if not bool(np.all(np.isfinite(block.seq))) or bool(np.any(block.seq != np.floor(block.seq))) or bool(np.any(np.diff(block.seq) <= 0)):
            self._fault("bad_counter", f"{kind}: the sample counter must be whole and increase")
            return []
        seq = block.seq.astype(np.int64)
        found: list[Samples | Gap] = []
        if self._restarted(ring, seq):
            self._fault("restart", f"{kind}: the counter went back from {ring.newest} to {int(seq[0])}")
            found.append(self._anew(int(seq[0])))
        elif int(seq[-1]) < ring.newest - self._reorder:
            self._fault("late", f"{kind}: samples {int(seq[0])}..{int(seq[-1])} came {ring.newest - int(seq[-1])} samples late", len(seq))
            return found
        ring.learn_rate(block)
        usable = self._check_values(kind, seq, block.values[:, columns]) & self._check_time(kind, ring, seq, block.time)
        if ring.jumping >= RATE_SAMPLES:
            self._fault("restart", f"{kind}: for {ring.jumping} samples the time has not followed {ring.rate:.6g} Hz; the rate is estimated again")
            return [*found, self._anew(int(seq[-1]) + 1)]
        if self._next is not None:
            past = seq < self._next
            if bool(np.any(past & usable)):
                self.counts["duplicated"] += int(np.count_nonzero(past & usable))
            usable &= ~past
        found += self._make_room(int(seq[-1]))
        doubled = ring.put(seq[usable], block.values[usable][:, columns], block.time[usable])
        if doubled:
            self.counts["duplicated"] += doubled
        ring.newest = max(ring.newest, int(seq[-1]))
        return found + self._go_on(kind, ring)

    def _go_on(self, kind: Quantity, ring: Ring) -> list[Samples | Gap]:
        """Return what can be paired after new samples; nothing for a stream whose rate has changed."""
        if ring.left_its_rate():
            self._fault(
                "restart", f"{kind}: from about counter {ring.newest} on the time does not follow {ring.rate:.6g} Hz; the rate is estimated again"
            )
            return [self._anew(ring.newest + 1)]
        return [] if self._rates_differ() else self._emit()

    def _anew(self, counter: int) -> Gap:
        """Reset both streams, including their rates."""
        for ring in self._rings.values():
            ring.clear()
        self._next, self._cuts, self._bad = None, {}, {}
        return Gap(counter, 0, "restart")

    def _columns(self, kind: Quantity, block: Block) -> list[int] | None:
        missing = [name for name in self.axes if name not in block.axes]
        if missing or block.values.shape != (len(block), len(block.axes)):
            self._fault("wrong_columns", f"{kind}: columns {', '.join(block.axes)}; expected {', '.join(self.axes)}")
            return None
        return [block.axes.index(name) for name in self.axes]

    def _fault(self, reason: str, text: str, number: int = 1) -> None:
        self.counts[reason] += number
        self.said[reason] = text

    def _restarted(self, ring: Ring, seq: NDArray[np.int64]) -> bool:
        """A jump far back that continues consistently is a restart; a single old block is only late."""
        if ring.newest < 0 or int(seq[0]) > ring.newest - self._reorder:
            ring.behind = 0
            return False
        ring.behind = ring.behind + 1 if int(seq[0]) == ring.behind_next else 1
        ring.behind_next = int(seq[-1]) + 1
        return ring.behind >= RESTART_BLOCKS

    def _check_values(self, kind: Quantity, seq: NDArray[np.int64], values: FloatArray) -> NDArray[np.bool_]:
        good = np.asarray(np.isfinite(values).all(axis=1), dtype=np.bool_)
        if not bool(good.all()):
            bad = seq[~good]
            self._fault("not_finite", f"{kind}: {len(bad)} samples from counter {int(bad[0])} on are not finite", len(bad))
            self._bad.update(dict.fromkeys(bad.tolist(), "not_finite"))
        return good

    def _check_time(self, kind: Quantity, ring: Ring, seq: NDArray[np.int64], time: FloatArray) -> NDArray[np.bool_]:
        """(n,) usable samples by their times: a jump of time against the counter cuts a run, invalid times are refused."""
        good = np.asarray(np.isfinite(time), dtype=np.bool_)
        if ring.rate is not None and bool(good.any()):
            offset = time - seq / ring.rate
            before = offset[good][0] if ring.offset is None else ring.offset
            moved = np.abs(np.diff(np.concatenate(([before], np.where(good, offset, before))))) > TIME_TOLERANCE / ring.rate
            places = np.flatnonzero(moved)
            ring.jumping = ring.jumping + int(places.size) if places.size > len(seq) // 4 else 0
            if places.size:
                ring.jumped()
                self._fault("time_jump", f"{kind}: time jumps at counter {int(seq[places[0]])}", int(places.size))
            if places.size > 1 and places.size > len(seq) // 4:
                good = np.zeros_like(good)
            for place in places[:8]:
                self._cuts[int(seq[place])] = "time_jump"
            ring.offset = float(offset[good][-1]) if bool(good.any()) else float(before)
        if not bool(good.all()):
            self._bad.update(dict.fromkeys(seq[~good].tolist(), "time_jump"))
        return good

    def _rates_differ(self) -> bool:
        rates = [ring.rate for ring in self._rings.values()]
        if rates[0] is None or rates[1] is None or abs(rates[0] / rates[1] - 1.0) <= RATE_TOLERANCE:
            return False
        self._fault("unequal_rates", f"voltage comes at {rates[0]:.6g} Hz, position at {rates[1]:.6g} Hz; they must be equal")
        if self.counts["unequal_rates"] % LOOK_AGAIN == 0:  # one rate may have been estimated while its source caught up after a delay
            self._anew(-1)
        return True

    def _make_room(self, newest: int) -> list[Samples | Gap]:
        """Give up samples that would be overwritten if one stream is far ahead of the other."""
        capacity = self._rings["voltage"].capacity
        if self._next is None or newest - self._next < capacity:
            return []
        gap = Gap(self._next, newest - capacity // 2 - self._next, "overrun")
        self._fault("overrun", f"one stream is {newest - self._next} samples ahead of the other", gap.samples)
        self._next = newest - capacity // 2
        return [gap]

    def _emit(self) -> list[Samples | Gap]:
        voltage, position = self._rings["voltage"], self._rings["position"]
        end = min(voltage.newest, position.newest) + 1
        if voltage.newest < 0 or position.newest < 0:
            return []
        if self._next is None:
            self._next = max(self._first(voltage), self._first(position))
        found: list[Samples | Gap] = []
        while self._next < end:
            whole = shared(voltage, position, self._next, end)
            if whole:
                found += self._run(self._next, self._next + whole)
                self._next += whole
                continue
            rest = np.flatnonzero(voltage.filled(self._next, end) & position.filled(self._next, end))
            if end - self._next <= self._reorder and not self._all_known_bad(int(rest[0]) if rest.size else 0):
                break
            skip = int(rest[0]) if rest.size else end - self._next
            reason = self._bad.get(self._next, "lost")
            if reason == "lost":
                self._fault("lost", f"{skip} samples from counter {self._next} on never came", skip)
            found.append(Gap(self._next, skip, reason))
            self._next += skip
        self._bad = {seq: reason for seq, reason in self._bad.items() if seq >= self._next} if self._bad else self._bad
        return found

    def _all_known_bad(self, length: int) -> bool:
        """True if all missing samples are known to be invalid, so that waiting is useless."""
        start = self._next or 0
        return length > 0 and all(start + i in self._bad for i in range(length))

    @staticmethod
    def _first(ring: Ring) -> int:
        return int(ring.tag[ring.tag >= 0].min()) if bool(np.any(ring.tag >= 0)) else ring.newest + 1

    def _run(self, first: int, last: int) -> list[Samples | Gap]:
        found: list[Samples | Gap] = []
        cuts = sorted(seq for seq in self._cuts if seq < last)
        for cut in cuts:
            reason = self._cuts.pop(cut)
            if cut < first:
                cut = first
            if cut > first:
                found.append(self._samples(first, cut))
            found.append(Gap(cut, 0, reason))
            first = cut
        if last > first:
            found.append(self._samples(first, last))
        return found

    def _samples(self, first: int, last: int) -> Samples:
        voltage, position = self._rings["voltage"], self._rings["position"]
        return Samples(first, voltage.take(first, last), position.take(first, last), position.stamps(first, last))
