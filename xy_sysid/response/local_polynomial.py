"""The local polynomial method: the response and the transients of each window as polynomials over the lines around each line.

Within 2 n + 1 lines around line k, a window's spectrum is Y(k + r) = G(k + r) U(k + r) + T(k + r) + V. G and the transient T (leakage from the
ends of a window) are smooth, so each is a polynomial in r. Linear least squares separates them, because U varies from line to line. All
windows share G. Each has its own T, which is projected out. The samples have no taper, so nothing is smoothed: with few windows and
sharp resonances, bias and variance are smaller than with H1. (Pintelon, Schoukens, Vandersteen & Barbé, Mech. Syst. Signal Process. 24
(2010), 573-595; Pintelon & Schoukens, System Identification, 2nd ed., sec. 7.2.2)

The local rational method gives G a denominator: (1 + a1 r + a2 r^2) Y = B U + T, which follows a resonance that is narrower than the lines used
(McKelvey & Guérin, SYSID 2012). Its unknowns multiply the noisy output, so near a resonance that is narrower than a line sigma is up to four
times too small.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import EXCITED, MARGIN, STRONG, H1Options, divisor
from xy_sysid.response.spectra import State
from xy_sysid.response.windows import Window, WindowShape
from xy_sysid.samples.block import FloatArray

ORDER = 2  # order of both polynomials
POLES = 2  # order of the local rational method's denominator
SIDE = 6  # lines to each side: 13 lines for the 6 unknowns of a single window, or 8 of the rational method
CORRELATED = 0.02  # a smaller correlation of two lines' errors is neglected


@dataclass(frozen=True, slots=True)
class LocalSums:
    """Normal equations of each line, summed over windows.

    normal: (lines, p, p), right: (lines, p), power: (lines,) of the data to explain; gxx: (lines,) input power; weight, square: sums of the windows'
    weights and of their squares
    """

    normal: ComplexArray
    right: ComplexArray
    power: FloatArray
    gxx: FloatArray
    weight: float
    square: float


@lru_cache(maxsize=8)
def _around(lines: int) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """(lines, 2 n + 1) indices of the lines around each, without 0 Hz; their distance over n; the projection that removes polynomials."""
    first = np.clip(np.arange(lines) - SIDE, 1, max(lines - 1 - 2 * SIDE, 1))
    place = first[:, None] + np.arange(2 * SIDE + 1)[None, :]
    distance = (place - np.arange(lines)[:, None]) / SIDE
    smooth = np.vander(np.arange(-SIDE, SIDE + 1) / SIDE, ORDER + 1)
    own, _ = np.linalg.qr(smooth)
    return place, distance, np.eye(2 * SIDE + 1) - own @ own.T


def of_window(u: FloatArray, y: FloatArray, rational: bool) -> LocalSums:
    """The sums of one window: input and output (n,); y is already differenced if needed."""
    inputs, outputs = np.fft.rfft(u - u.mean()), np.fft.rfft(y - y.mean())
    place, distance, free = _around(inputs.size)
    around, seen = inputs[place], outputs[place] @ free
    columns = [around * distance**k for k in range(ORDER + 1)]
    if rational:
        columns += [-outputs[place] * distance**k for k in range(1, POLES + 1)]
    known = np.stack(columns, axis=2)
    through = np.einsum("ab,kbp->kap", free, known)
    return LocalSums(
        normal=np.einsum("kap,kaq->kpq", through.conj(), through),
        right=np.einsum("kap,ka->kp", through.conj(), seen),
        power=np.sum(np.abs(seen) ** 2, axis=1),
        gxx=np.mean(np.abs(around) ** 2, axis=1),
        weight=1.0,
        square=1.0,
    )


def added(old: LocalSums | None, new: LocalSums, keep: float = 1.0) -> LocalSums:
    """The sum of both, the old one multiplied by ``keep``."""
    if old is None:
        return new
    return LocalSums(
        normal=keep * old.normal + new.normal,
        right=keep * old.right + new.right,
        power=keep * old.power + new.power,
        gxx=keep * old.gxx + new.gxx,
        weight=keep * old.weight + new.weight,
        square=keep**2 * old.square + new.square,
    )


class LocalTransformer:
    """Turns windows into the sums of each axis."""

    def __init__(self, differenced: bool, rational: bool) -> None:
        self._differenced, self._rational = differenced, rational

    def __call__(self, window: Window) -> list[LocalSums]:
        """One LocalSums for each axis of the window."""
        output = np.diff(window.position, axis=0) if self._differenced else window.position
        return [of_window(u, y, self._rational) for u, y in zip(window.voltage.T, output.T, strict=True)]


class RunningLocal:
    """update(window) and get(), as ``RunningSpectra``, of the normal equations."""

    def __init__(self, forget: float = 1.0, sliding: int = 0) -> None:
        """forget: factor for old sums, per window; sliding: number of windows to keep, 0 for all."""
        self._forget, self._sum = forget, None  # type: tuple[float, LocalSums | None]
        self._kept: deque[LocalSums] = deque(maxlen=sliding or None)
        self._sliding = sliding

    def update(self, window: LocalSums) -> None:
        """Add one window."""
        if self._sliding:
            self._kept.append(window)
        else:
            self._sum = added(self._sum, window, self._forget)

    def get(self) -> LocalSums:
        """The sums so far; needs at least one window."""
        total = self._sum
        for window in self._kept:
            total = added(total, window)
        assert total is not None
        return total

    def state(self) -> State:
        """The state as arrays, to continue later."""
        kept = list(self._kept) if self._sliding else [self._sum] if self._sum is not None else []
        names = ("normal", "right", "power", "gxx", "weight", "square")
        return {name: np.array([getattr(one, name) for one in kept]) for name in names}

    def restore(self, state: State) -> None:
        """Continue from a state of the same shape."""
        self._kept.clear()
        self._sum = None
        for k in range(len(state["weight"])):
            one = LocalSums(
                normal=np.asarray(state["normal"][k], dtype=np.complex128),
                right=np.asarray(state["right"][k], dtype=np.complex128),
                power=np.real(state["power"][k]),
                gxx=np.real(state["gxx"][k]),
                weight=float(np.real(state["weight"][k])),
                square=float(np.real(state["square"][k])),
            )
            if self._sliding:
                self._kept.append(one)
            else:
                self._sum = one


def local_response(sums: LocalSums, shape: WindowShape, sampling_rate: float, options: H1Options) -> FrequencyResponse:
    """The response of one axis at the lines inside the band, except 0 Hz.

    Coherence is computed from the estimated noise and response. Errors of lines within 2 n of each other are correlated.
    """
    every = np.arange(sums.power.size) * sampling_rate / shape.length
    inside = np.flatnonzero((every > 0) & (every >= options.band[0]) & (every <= min(options.band[1], 0.5 * sampling_rate)))
    frequency, unknown = every[inside], sums.right.shape[1]
    windows = sums.weight**2 / max(sums.square, 1e-300)
    freedom = windows * (2 * SIDE - ORDER) - unknown
    normal, right = sums.normal[inside], sums.right[inside]
    size = np.maximum(np.real(np.einsum("kpp->kp", normal)), np.finfo(float).tiny)
    scaled = normal / np.sqrt(size[:, :, None] * size[:, None, :])
    inverse = np.linalg.pinv(scaled, rcond=1e-10, hermitian=True) / np.sqrt(size[:, :, None] * size[:, None, :])
    found = np.einsum("kpq,kq->kp", inverse, right)
    left = np.maximum(sums.power[inside] - np.real(np.einsum("kp,kp->k", right.conj(), found)), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = left / (freedom * sums.weight / windows) if freedom > 0.0 else np.full(inside.size, np.inf)
        response, sigma = found[:, 0], np.sqrt(noise * np.maximum(np.real(inverse[:, 0, 0]), 0.0))
        signal = np.abs(response) ** 2 * sums.gxx[inside] / sums.weight
        coherence = np.nan_to_num(signal / (signal + noise), nan=0.0)
        if options.differenced:
            step = divisor(frequency, sampling_rate)
            response, sigma = response / step, sigma / np.abs(step)
    power = sums.gxx[inside]
    near = slice(MARGIN, None) if inside.size > 2 * MARGIN else slice(None)
    strong = float(np.quantile(power[near], STRONG)) if power.size else 0.0
    trusted = (power > EXCITED * strong) & (coherence >= options.min_coherence) & np.isfinite(sigma) & (sigma > 0.0)
    return FrequencyResponse(
        frequency=frequency,
        response=response,
        coherence=coherence,
        sigma=sigma,
        trusted=trusted,
        sampling_rate=sampling_rate,
        averages=freedom + 1.0,
        resolution=sampling_rate / shape.length,
        input_unit=options.units[0],
        output_unit=options.units[1],
        rate_error=options.rate_error,
        line_correlation=_correlation(),
        differenced=False,
    )


@lru_cache(maxsize=1)
def _correlation() -> FloatArray:
    """Correlation of the errors of lines 0, 1, .. apart, from the weights that a polynomial's middle gives to its neighbours."""
    smooth = np.vander(np.arange(-SIDE, SIDE + 1) / SIDE, ORDER + 1, increasing=True)
    weights = np.linalg.pinv(smooth)[0]
    shared = np.correlate(weights, weights, "full")[weights.size - 1 :]
    found = shared / shared[0]
    return np.asarray(found[: int(np.max(np.flatnonzero(np.abs(found) > CORRELATED))) + 1])
