"""Running auto and cross spectra: add a window, forget, or slide.

Gxx, Gyy, Gyx are sums over windows of |X|^2, |Y|^2 and Y conj(X), without the scale to a power spectral density, which
cancels in the frequency response. (Welch 1967; Bendat & Piersol, Random Data, 4th ed., sec. 11.5)
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray
from xy_sysid.response.windows import LINES_APART, Window, WindowShape, error_correlation
from xy_sysid.samples.block import FloatArray

State = dict[str, NDArray[Any]]
SUMS = 16  # partial sums of a mean: less rounding, and they run in parallel


@dataclass(frozen=True, slots=True)
class WindowSpectrum:
    """Spectra of one axis in one window: gxx, gyy (lines,), gyx (lines,) complex, and the window's index on the grid."""

    index: int
    gxx: FloatArray
    gyy: FloatArray
    gyx: ComplexArray


@dataclass(frozen=True, slots=True)
class Spectra:
    """Weighted sums over windows, of one axis.

    gxx, gyy:  (lines,) real
    gyx:       (lines,) complex
    weight:    sum of the windows' weights
    quadratic: (LINES_APART,) sum over pairs of windows of weight_i weight_j correlation_ij(lines apart); it gives the
               effective number of averages, weight^2 / quadratic[0], for any overlap, gaps and forgetting
    """

    gxx: FloatArray
    gyy: FloatArray
    gyx: ComplexArray
    weight: float
    quadratic: FloatArray

    @property
    def averages(self) -> float:
        """Effective number of independent windows; 0 without any."""
        return float(self.weight**2 / self.quadratic[0]) if self.weight > 0 else 0.0


@compiled
def mean(values: FloatArray) -> float:
    """Mean of (n,) values."""
    sums, total = np.zeros(SUMS), 0.0
    for i in range(0, values.shape[0] - SUMS + 1, SUMS):
        for k in range(SUMS):
            sums[k] += values[i + k]
    for k in range(SUMS):
        total += sums[k]
    for i in range(values.shape[0] - values.shape[0] % SUMS, values.shape[0]):
        total += values[i]
    return float(total / values.shape[0])


@compiled
def _tapered(values: FloatArray, taper: FloatArray) -> FloatArray:
    """(columns, n) each column of values (n, columns) without its mean, tapered."""
    out = np.empty((values.shape[1], values.shape[0]))
    for k in range(values.shape[1]):
        for i in range(values.shape[0]):
            out[k, i] = values[i, k]
        middle = mean(out[k])
        for i in range(values.shape[0]):
            out[k, i] = (out[k, i] - middle) * taper[i]
    return out


class Transformer:
    """Turns windows of samples into spectra: mean removed, tapered, position differenced if requested."""

    def __init__(self, shape: WindowShape, differenced: bool) -> None:
        self.shape = shape
        self.differenced = differenced
        self._taper = shape.taper()

    def __call__(self, window: Window) -> list[WindowSpectrum]:
        """One spectrum for each axis of the window."""
        output = np.diff(window.position, axis=0) if self.differenced else window.position
        return [of_pair(window.index, x, y) for x, y in zip(self.lines(window.voltage), self.lines(output), strict=True)]

    def lines(self, values: FloatArray) -> ComplexArray:
        """(axes, lines) of (length, axes) samples of one signal."""
        return np.asarray(scipy.fft.rfft(_tapered(values, self._taper)), dtype=np.complex128)


def of_pair(index: int, x: ComplexArray, y: ComplexArray) -> WindowSpectrum:
    """Spectra of a window from the lines of both signals, (lines,) each."""
    return WindowSpectrum(index, _power(x), _power(y), y * x.conj())


def _power(z: ComplexArray) -> FloatArray:
    return np.asarray(z.real**2 + z.imag**2, dtype=np.float64)


class RunningSpectra:
    """update(window) and get(): sums over all windows, with exponential forgetting, or over the newest few."""

    def __init__(self, shape: WindowShape, forget: float = 1.0, sliding: int = 0) -> None:
        """forget: factor on the old sums for each new window, 1: none; sliding: number of windows to keep, 0: all."""
        self.lines = shape.length // 2 + 1
        self.sliding = sliding
        self._forget = forget
        self._correlation = error_correlation(shape)
        self._kept: deque[WindowSpectrum] = deque(maxlen=sliding or None)
        self._recent: list[tuple[int, float]] = []
        self._sum = self._empty()

    def _empty(self) -> Spectra:
        zero = np.zeros(self.lines)
        return Spectra(gxx=zero, gyy=zero.copy(), gyx=zero.astype(np.complex128), weight=0.0, quadratic=np.zeros(LINES_APART))

    def update(self, window: WindowSpectrum) -> None:
        """Add one window."""
        if self.sliding:
            self._kept.append(window)
        else:
            self._sum = self._added(self._sum, window)

    def get(self) -> Spectra:
        """The spectra so far."""
        if not self.sliding:
            return self._sum
        self._recent = []
        total = self._empty()
        for window in self._kept:
            total = self._added(total, window)
        return total

    def reset(self) -> None:
        """Delete all windows."""
        self._kept.clear()
        self._recent = []
        self._sum = self._empty()

    def _added(self, old: Spectra, new: WindowSpectrum) -> Spectra:
        keep = self._forget
        reach = self._correlation.shape[0] - 1
        self._recent = [(index, weight * keep) for index, weight in self._recent if 0 < new.index - index <= reach]
        quadratic = keep**2 * old.quadratic + self._correlation[0]
        for index, weight in self._recent:
            quadratic = quadratic + 2.0 * weight * self._correlation[new.index - index]
        self._recent.append((new.index, 1.0))
        return Spectra(
            gxx=keep * old.gxx + new.gxx,
            gyy=keep * old.gyy + new.gyy,
            gyx=keep * old.gyx + new.gyx,
            weight=keep * old.weight + 1.0,
            quadratic=quadratic,
        )

    def state(self) -> State:
        """The state as arrays, to continue later."""
        kept = list(self._kept)
        empty = np.zeros((0, self.lines))
        return {
            "gxx": self._sum.gxx,
            "gyy": self._sum.gyy,
            "gyx": self._sum.gyx,
            "weight": np.array([self._sum.weight]),
            "quadratic": self._sum.quadratic,
            "recent": np.array(self._recent, dtype=np.float64).reshape(-1, 2),
            "kept_index": np.array([w.index for w in kept], dtype=np.float64),
            "kept_gxx": np.stack([w.gxx for w in kept]) if kept else empty,
            "kept_gyy": np.stack([w.gyy for w in kept]) if kept else empty,
            "kept_gyx": np.stack([w.gyx for w in kept]) if kept else empty.astype(np.complex128),
        }

    def restore(self, state: State) -> None:
        """Continue from a state of the same shape."""
        self._sum = Spectra(
            gxx=np.real(state["gxx"]), gyy=np.real(state["gyy"]), gyx=np.asarray(state["gyx"], dtype=np.complex128),
            weight=float(np.real(state["weight"][0])), quadratic=np.real(state["quadratic"]),
        )  # fmt: skip
        self._recent = [(int(index), float(weight)) for index, weight in np.real(state["recent"])]
        self._kept.clear()
        for i, index in enumerate(np.real(state["kept_index"])):
            kept = (np.real(state["kept_gxx"][i]), np.real(state["kept_gyy"][i]), np.asarray(state["kept_gyx"][i], dtype=np.complex128))
            self._kept.append(WindowSpectrum(int(index), *kept))
