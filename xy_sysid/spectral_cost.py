"""How large an error in velocity is, band by band, against the least that the data allow.

The error passes overlapping Hann windows; one line of one window is one number. With half overlap the windows add up to a
constant, so scaled by ``1 / sqrt(sum of window^2 per sample)`` the squares add up to those of the samples (Parseval), and
divided by the power density of the error they are the terms of a likelihood (Whittle 1953).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from xy_sysid.stream import FloatArray

ComplexArray = NDArray[np.complex128]

TOP = 700.0  # Hz; above, at 2 kHz, differences of an encoder's position are all noise
TOP_SHARE = 0.35  # of the sampling rate, for slow sampling
WINDOW = 2.0  # s, nearly: the lowest band is 1/2 Hz wide
NOISE_BAND = (0.6, 0.94)  # of Nyquist: the quietest twentieth there is the encoder's; friction's harmonics may reach in
SEEN = 3.0  # a band is excited if the measured velocity has this many times the encoder's noise


@dataclass(frozen=True, slots=True)
class Bands:
    """Windows and bands of one sampling rate.

    length: samples of a window; band: (lines,) number of the band that each line of the spectrum up to the top is in
    """

    sampling_rate: float
    length: int
    band: NDArray[np.int64]
    count: int

    @property
    def frequency(self) -> FloatArray:
        """(lines,) Hz."""
        return np.asarray(np.arange(self.band.size) * self.sampling_rate / self.length)

    def edges(self) -> FloatArray:
        """(count + 1,) Hz: where each band begins, and where the last one ends."""
        first = np.searchsorted(self.band, np.arange(self.count))
        return np.append(self.frequency[first], self.frequency[-1])

    def spectrum(self, signal: FloatArray) -> ComplexArray:
        """(windows, lines) of a signal (n,) in m/s; squares add up to those of the samples, m^2/s^2."""
        hop = self.length // 2
        if signal.size < self.length:
            signal = np.concatenate((signal, np.zeros(self.length - signal.size)))
        taper = np.sqrt(2.0 / 0.75 / self.length) * np.sin(np.pi * (np.arange(self.length) + 0.5) / self.length) ** 2
        windows = np.lib.stride_tricks.sliding_window_view(signal, self.length)[::hop]
        return np.asarray(scipy.fft.rfft(windows * taper, axis=1)[:, : self.band.size])

    def power(self, spectrum: ComplexArray) -> FloatArray:
        """(count,) variance per sample that each band would have if its density held up to Nyquist, m^2/s^2."""
        lines = np.mean(spectrum.real**2 + spectrum.imag**2, axis=0)
        return np.asarray(np.bincount(self.band, lines, self.count) / np.bincount(self.band, minlength=self.count))


def bands(sampling_rate: float, samples: int, count: int = 36) -> Bands:
    """Windows of about 2 s (less for short data) and ``count`` bands or fewer, evenly spaced in the logarithm."""
    wanted = min(WINDOW * sampling_rate, samples / 4.0)
    length = 2 ** max(int(np.round(np.log2(max(wanted, 16.0)))), 4)
    top = min(TOP, TOP_SHARE * sampling_rate)
    last = max(int(top * length / sampling_rate), 2)
    edges = np.unique(np.round(np.geomspace(2.0, last + 1, count + 1)).astype(np.int64))
    band = np.maximum(np.searchsorted(edges, np.arange(last + 1), side="right") - 1, 0)
    return Bands(sampling_rate, length, band, int(band[-1]) + 1)


@dataclass(frozen=True, slots=True)
class Floor:
    """What no model can go below.

    power:   (bands,) m^2/s^2, as of ``Bands.power``; excited: (bands,) bool
    encoder: rms of the encoder's noise in position, m; epsilon: part of the signal that a model may leave
    """

    power: FloatArray
    excited: NDArray[np.bool_]
    encoder: float
    epsilon: float


def encoder_noise(sampling_rate: float, position: FloatArray) -> float:
    """rms of white noise in position, m: from the quietest band below Nyquist, not below what counting alone makes."""
    velocity = np.diff(position) * sampling_rate
    length = min(4096, velocity.size // 2 * 2)
    windows = np.lib.stride_tricks.sliding_window_view(velocity, length)[:: length // 2] * np.hanning(length)
    power = np.mean(np.abs(scipy.fft.rfft(windows, axis=1)) ** 2, axis=0) / np.sum(np.hanning(length) ** 2)
    share = np.arange(power.size) / (length / 2.0)
    white = power / np.maximum((2.0 * np.sin(0.5 * np.pi * share) * sampling_rate) ** 2, 1e-300)
    seen = [float(np.median(white[(share >= low) & (share < low + 0.05)])) for low in np.arange(*NOISE_BAND, 0.05)]
    return float(np.sqrt(max(min(seen), count_size(position) ** 2 / 12.0)))


def count_size(position: FloatArray) -> float:
    """Step of the encoder, m: the smallest difference that most others are multiples of; 0 if there is none."""
    steps = np.abs(np.diff(position))
    steps = np.unique(steps[steps > 0.0])
    if steps.size == 0:
        return 0.0
    scale = float(np.max(np.abs(position))) + 1e-300
    least = float(steps[steps > 16.0 * np.finfo(np.float64).eps * scale].min(initial=np.inf))
    if not np.isfinite(least):
        return 0.0
    whole = steps[steps < 200.0 * least] / least
    fits = np.abs(whole - np.round(whole)) < 1e-3 * np.maximum(whole, 1.0)
    return least if whole.size >= 2 and float(np.mean(fits)) > 0.9 else 0.0


def floor(layout: Bands, velocity: FloatArray, encoder: float, epsilon: float) -> Floor:
    """The floor of data with this measured velocity (n,), m/s."""
    share = np.bincount(layout.band, (2.0 * np.sin(np.pi * layout.frequency / layout.sampling_rate)) ** 2, layout.count)
    noise = share / np.bincount(layout.band, minlength=layout.count) * (encoder * layout.sampling_rate) ** 2
    signal = layout.power(layout.spectrum(velocity))
    own = np.maximum(signal - noise, 0.0)
    around = np.concatenate(([own[0]], own, [own[-1]]))
    envelope = np.maximum(np.maximum(around[:-2], around[2:]), own)
    return Floor(noise + epsilon**2 * envelope, signal > SEEN * noise, encoder, epsilon)


def tolerance(layout: Bands, error: ComplexArray, least: Floor) -> FloatArray:
    """(bands,) m^2/s^2 by which squared errors (a spectrum of them) are divided in a fit.

    What a model leaves above the floor is systematic: taken as one common error of each band (as Kennedy & O'Hagan 2001 do
    for model discrepancy), it does not average out over the band's lines. So at the floor every line counts, and far above
    it every band does, wide or narrow.
    """
    lines = np.bincount(layout.band, minlength=layout.count)
    return np.asarray(least.power + lines * np.maximum(layout.power(error) - least.power, 0.0))


def excess(layout: Bands, error: FloatArray, least: Floor) -> float:
    """Mean over the excited bands of ln(power of the error / floor), none counted below 0: 0 is nothing left to explain."""
    ratio = layout.power(layout.spectrum(error)) / np.maximum(least.power, 1e-300)
    used = least.excited if bool(np.any(least.excited)) else np.ones_like(least.excited)
    return float(np.mean(np.maximum(np.log(np.maximum(ratio[used], 1e-12)), 0.0)))
