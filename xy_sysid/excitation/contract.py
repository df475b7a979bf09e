"""The interface of every excitation signal, and two implementations: a repeated table, and a stream of parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation

MAX_TABLE = 2**24  # samples of one period kept in memory (128 MB); 2.3 hours at 2 kHz


class Signal(Protocol):
    """An endless stream of samples in V; any chunking gives the same samples, bit for bit."""

    def next(self, n: int) -> FloatArray:
        """(n,) the following samples, V."""
        ...


Maker = Callable[[AxisExcitation, float], Signal]


@dataclass(slots=True)
class Periodic:
    """A table of one period, (period,) V, repeated without end."""

    table: FloatArray
    _at: int = 0

    def next(self, n: int) -> FloatArray:
        """(n,) the following samples, V."""
        index = np.arange(self._at, self._at + n) % self.table.size
        self._at = (self._at + n) % self.table.size
        return self.table[index]


@dataclass(slots=True)
class Parts:
    """A stream from the arrays of an endless iterator; stores one array at a time."""

    parts: Iterator[FloatArray]
    _left: FloatArray

    @classmethod
    def of(cls, parts: Iterator[FloatArray]) -> Parts:
        """The stream of these arrays, one after the other."""
        return cls(parts, np.empty(0))

    def next(self, n: int) -> FloatArray:
        """(n,) the following samples, V."""
        if n <= self._left.size:
            piece, self._left = self._left[:n], self._left[n:]
            return piece
        pieces = []
        while n > self._left.size:
            pieces.append(self._left)
            n -= self._left.size
            self._left = next(self.parts)
        pieces.append(self._left[:n])
        self._left = self._left[n:]
        return np.concatenate(pieces)


def samples(seconds: float, rate: float, least: int, what: str) -> int:
    """Number of samples in a period; raises BadInput if there are fewer than ``least`` or too many to store."""
    count = round(seconds * rate)
    if not least <= count <= MAX_TABLE:
        raise BadInput(
            f"{what} of {seconds:g} s at {rate:g} Hz", f"{count} samples", f"{least} to {MAX_TABLE} samples", "Change period, low or the rate."
        )
    return count


def below_nyquist(settings: AxisExcitation, rate: float) -> None:
    """Raise BadInput unless the highest frequency is below half the sampling rate."""
    if settings.high >= rate / 2:
        raise BadInput("high", f"{settings.high:g} Hz", f"below half the rate, {rate / 2:g} Hz", "Lower high or raise the rate.")


def crest(table: FloatArray) -> float:
    """Largest magnitude over root mean square; 0 for a signal that is 0."""
    rms = float(np.sqrt(np.mean(table * table)))
    return float(np.max(np.abs(table))) / rms if rms > 0 else 0.0
