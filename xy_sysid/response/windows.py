"""Overlapping windows of gap-free samples, and the effect of a window on an estimate.

Windows start at multiples of the hop of the sample counter, so that the same samples give the same windows in any chunking, also
for a node that starts later.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray, Samples

KERNEL_TAIL = 2e-5  # part of the window's power that may be cut from the smoothing kernel
KERNEL_MOST = 64  # most half lines to each side (the tail of a boxcar is infinite)
LINES_APART = 5  # errors of lines further apart count as independent (Hann: correlation 1/36 two lines apart, 0 beyond)
COSINES = {  # factors of the cosines of order 0, 1, ... of each taper (D'Antona & Ferrero, Digital Signal Processing for Measurement Systems, 2006)
    "hann": (0.5, 0.5),
    "hamming": (0.54, 1.0 - 0.54),
    "blackman": (0.42, 0.50, 0.08),
    "blackmanharris": (0.35875, 0.48829, 0.14128, 0.01168),
    "flattop": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
    "boxcar": (1.0,),
}


@dataclass(frozen=True, slots=True)
class WindowShape:
    """A taper, its length and the hop from one window to the next, in samples."""

    name: str
    length: int
    hop: int

    @classmethod
    def of(cls, name: str, length: int, overlap: float) -> WindowShape:
        """From the overlap as a fraction; raises BadInput if the hop would be less than one sample."""
        hop = round(length * (1.0 - overlap))
        if hop < 1 or hop > length:
            raise BadInput("overlap", overlap, f"0 to {1 - 1 / length:.4g} for {length} samples", "Choose a smaller overlap.")
        return cls(name, length, hop)

    def taper(self) -> FloatArray:
        """(length,) periodic taper, read-only, bit for bit that of scipy.signal.get_window, whose import takes half a second."""
        return _taper(self.name, self.length)


@lru_cache(maxsize=8)
def _taper(name: str, length: int) -> FloatArray:
    if name not in COSINES:
        raise BadInput("window", repr(name), ", ".join(COSINES), "Choose one of these.")
    angle, values = np.linspace(-np.pi, np.pi, length + 1), np.zeros(length + 1)
    for order, part in enumerate(COSINES[name]):
        values += part * np.cos(order * angle)
    values = values[:length].copy()
    values.setflags(write=False)
    return values


def blur_kernel(shape: WindowShape) -> FloatArray:
    """(2 j + 1,) weights at half-line steps, centred: the smoothing of the response by the window, for a locally white input.

    E[Y conj(X)] / E|X|^2 = sum over lags of g(lag) r(lag)/r(0), with r the window's autocorrelation: the response
    convolved with |W(f)|^2, which 2 L points represent exactly as r is shorter than 2 L. (Bendat & Piersol, 4th ed., sec. 11.5)
    """
    power = np.abs(np.fft.fft(shape.taper(), 2 * shape.length)) ** 2
    power /= power.sum()
    most = min(KERNEL_MOST, shape.length - 1)
    for half in range(1, most + 1):
        side = power[1 : half + 1]
        if power[0] + 2 * side.sum() >= 1.0 - KERNEL_TAIL:
            break
    weights = np.concatenate((side[::-1], power[:1], side))
    return np.asarray(weights / weights.sum(), dtype=np.float64)


@lru_cache(maxsize=8)
def error_correlation(shape: WindowShape) -> FloatArray:
    """(m, LINES_APART) correlation of H1 errors of windows m hops apart, of lines k apart; [0, 0] is 1.

    Both input and noise are locally white and independent, so it is the squared magnitude of the windows' overlap
    sum w(n) w(n + m hop) exp(-2 pi i n k / L) / sum w^2 (Welch 1967 for k = 0).
    """
    taper = shape.taper()
    most = (shape.length - 1) // shape.hop
    rows = np.empty((most + 1, LINES_APART))
    turn = np.exp(-2j * np.pi * np.arange(shape.length)[:, None] * np.arange(LINES_APART)[None, :] / shape.length)
    for m in range(most + 1):
        shift = m * shape.hop
        product = taper[: shape.length - shift] * taper[shift:]
        rows[m] = np.abs(product @ turn[: shape.length - shift]) ** 2
    rows /= rows[0, 0]
    rows.setflags(write=False)
    return rows


@dataclass(frozen=True, slots=True)
class Window:
    """One window of samples.

    index:    on the grid; the window starts at sample index * hop
    voltage:  (length, axes)
    position: (length + extra, axes), extra = 1 if the position is differenced
    reference: (length, axes) if the windows have one, otherwise (length, 0)
    """

    index: int
    voltage: FloatArray
    position: FloatArray
    reference: FloatArray = field(default_factory=lambda: np.empty((0, 0)))


class Windower:
    """Takes runs of samples, and returns windows; a step in the counter ends a run, and its unused samples are dropped."""

    def __init__(self, shape: WindowShape, axes: int, extra: int, reference: bool = False) -> None:
        """extra: additional samples of position in a window; reference: whether samples and windows have one."""
        self.shape = shape
        self._extra = extra
        self._axes = axes
        self._store = np.empty((0, (3 if reference else 2) * axes))
        self._start = 0
        self._filled = 0

    @property
    def _next(self) -> int:
        return self._start + self._filled

    def feed(self, samples: Samples) -> list[Window]:
        """The windows that these samples complete, in order."""
        if samples.seq != self._next or self._filled == 0:
            self._start, self._filled = samples.seq, 0
        self._append(samples)
        need = self.shape.length + self._extra
        found: list[Window] = []
        index = -(-self._start // self.shape.hop)
        while index * self.shape.hop + need <= self._next:
            a = index * self.shape.hop - self._start
            rows, inside = self._store[a : a + need], slice(self.shape.length)
            u, y, r = slice(self._axes), slice(self._axes, 2 * self._axes), slice(2 * self._axes, None)
            found.append(Window(index, rows[inside, u].copy(), rows[:, y].copy(), rows[inside, r].copy()))
            index += 1
        self._drop_before(index * self.shape.hop)
        return found

    def pending(self) -> int:
        """Number of samples that wait for the next window."""
        return self._filled

    def reset(self) -> None:
        """Drop the samples that wait for a full window."""
        self._filled = 0

    def _append(self, samples: Samples) -> None:
        end = self._filled + len(samples)
        if end > self._store.shape[0]:
            grown = np.empty((max(end, 2 * self._store.shape[0], 4 * self.shape.length), self._store.shape[1]))
            grown[: self._filled] = self._store[: self._filled]
            self._store = grown
        self._store[self._filled : end, : self._axes] = samples.voltage
        self._store[self._filled : end, self._axes : 2 * self._axes] = samples.position
        if self._store.shape[1] > 2 * self._axes:
            self._store[self._filled : end, 2 * self._axes :] = samples.reference
        self._filled = end

    def _drop_before(self, seq: int) -> None:
        cut = min(max(seq - self._start, 0), self._filled)
        if cut:
            keep = self._filled - cut
            self._store[:keep] = self._store[cut : self._filled].copy()
            self._start, self._filled = self._start + cut, keep
