"""The newest samples of a machine, paired and without gaps, for a live diagnosis."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from xy_sysid.samples.block import Block, FloatArray, Samples
from xy_sysid.samples.pairing import QUANTITIES, Gap, Pairer, Quantity
from xy_sysid.samples.rate import StampLine

FORGETS = ("restart", "unequal_rates")  # gaps after which earlier data may be from another machine


@dataclass(frozen=True, slots=True)
class NewestSamples:
    """Gap-free samples. seq: counter of the first; voltage, position: (n, axes) V and m."""

    sampling_rate: float
    seq: int
    voltage: FloatArray
    position: FloatArray

    @property
    def seconds(self) -> float:
        """Length in time."""
        return len(self.voltage) / self.sampling_rate


class _Run:
    """Consecutive samples, at least the newest ``most`` of them."""

    def __init__(self) -> None:
        self.parts: deque[Samples] = deque()
        self.size = 0

    def add(self, samples: Samples, most: float) -> None:
        self.parts.append(samples)
        self.size += len(samples)
        while self.size - len(self.parts[0]) >= most:
            self.size -= len(self.parts.popleft())


class Newest:
    """feed(kind, block), then ``newest``: the same blocks in any order of arrival give the same samples."""

    def __init__(self, axes: tuple[str, ...], memory: float, minimum: float, reorder: float) -> None:
        """memory: s to keep; minimum: duration in s from which a run replaces an earlier, longer one."""
        self.axes = axes
        self.total = 0
        self._memory, self._minimum = memory, minimum
        self._pairer = Pairer(axes, reorder)
        self._line = StampLine()
        self._now, self._before = _Run(), _Run()

    def feed(self, kind: Quantity, block: Block) -> None:
        """Read one block of one stream."""
        for event in self._pairer.feed(kind, block):
            if isinstance(event, Gap):
                if event.reason in FORGETS:
                    self._line = StampLine()
                elif event.reason == "time_jump":
                    self._line.cut()
                if self._now.size > self._before.size or self._now.size >= self._minimum * (self._pairer.rate or np.inf):
                    self._before = self._now
                self._before = _Run() if event.reason in FORGETS else self._before
                self._now = _Run()
            else:
                self.total += len(event)
                if event.time is not None:
                    self._line.add(event.seq, event.time)
                    self._line.until(event.seq + len(event))
                self._now.add(event, self._memory * (self._pairer.rate or np.inf))

    @property
    def sampling_rate(self) -> float | None:
        """Hz, from all stamps so far; None until it is known."""
        return self._line.rate if self._pairer.rate is not None and self._line.rate is not None else self._pairer.rate

    @property
    def faults(self) -> dict[str, int]:
        """Number of faults in the streams, by reason."""
        return dict(self._pairer.counts)

    @property
    def sentences(self) -> dict[str, str]:
        """The newest sentence for each reason."""
        return dict(self._pairer.said)

    @property
    def seconds(self) -> float:
        """Duration of the samples that ``newest`` would return, s."""
        return self._best().size / self.sampling_rate if self.sampling_rate else 0.0

    def lacking(self) -> str:
        """What is missing for a diagnosis, in words; empty if there are enough data."""
        silent = [kind for kind in QUANTITIES if self._pairer.waiting[kind] < 0]
        if silent:
            return f"no {' and no '.join(silent)} of axes {', '.join(self.axes)} received yet; start the machine and its excitation."
        if self.sampling_rate is None:
            return "the sampling rate is not known yet; wait, or check the time column."
        if self.seconds < self._minimum:
            lost = ", ".join(f"{name} {count}" for name, count in self.faults.items())
            why = f" (streams: {lost})" if lost else ""
            return f"{self.seconds:.3g} s without a gap{why}, {self._minimum:g} s are needed; continue the excitation."
        return ""

    def newest(self) -> NewestSamples:
        """The newest run, or the one before while it is short; check ``lacking`` first."""
        rate = self.sampling_rate or np.nan
        parts = self._best().parts
        most = round(self._memory * rate)
        voltage, position = (np.concatenate([getattr(part, name) for part in parts])[-most:] for name in ("voltage", "position"))
        return NewestSamples(rate, parts[-1].seq + len(parts[-1]) - voltage.shape[0], voltage, position)

    def _best(self) -> _Run:
        enough = self._minimum * (self.sampling_rate or np.inf)
        return self._now if self._now.size >= enough or self._now.size >= self._before.size else self._before
