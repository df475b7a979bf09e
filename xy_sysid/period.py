"""Does the input repeat itself? Then a window of one period leaks nothing, and lines between the excited ones are noise."""

from __future__ import annotations

import numpy as np
from scipy import fft

from xy_sysid.stream import FloatArray

LIKENESS = 0.98  # correlation of the input with itself one period later; measured inputs carry a little noise
FEWEST = 6  # periods that must be there, so that five are left to average after the transient


def find_period(u: FloatArray, shortest: int = 16) -> int | None:
    """Period of a (n,) input in samples, or None if it does not repeat at least six times.

    The first peak of the autocorrelation, checked and sharpened on the samples themselves.
    """
    signal = u - u.mean()
    number = signal.shape[0]
    power = float(np.dot(signal, signal))
    if number < FEWEST * shortest or power == 0.0:
        return None
    size = fft.next_fast_len(2 * number, real=True)
    correlation = fft.irfft(np.abs(fft.rfft(signal, size)) ** 2, size)[: number // FEWEST + 1]
    overlap = 1.0 - np.arange(correlation.shape[0]) / number
    likeness = correlation / (power * overlap)
    below = np.flatnonzero(likeness < 0.5)
    if below.size == 0:
        return None
    start = max(int(below[0]), shortest)
    peaks = np.flatnonzero(likeness[start:] > LIKENESS - 0.05) + start
    if peaks.size == 0:
        return None
    near = np.arange(max(int(peaks[0]) - 2, 1), min(int(peaks[0]) + 64, number // FEWEST) + 1)
    exact = [_likeness(signal, int(lag)) for lag in near]
    best = int(np.argmax(exact))
    return int(near[best]) if exact[best] > LIKENESS else None


def _likeness(signal: FloatArray, lag: int) -> float:
    a, b = signal[:-lag], signal[lag:]
    return float(np.dot(a, b) / np.sqrt(np.dot(a, a) * np.dot(b, b)))
