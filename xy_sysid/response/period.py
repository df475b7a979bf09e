"""Does the input repeat itself? Then a window of one period leaks nothing, and lines between the excited ones are noise."""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

LIKENESS = 0.98  # correlation of the input with itself one period later; measured inputs carry a little noise
OFF_WHOLE = 0.1  # of a sample that the true period may be off: windows then slip against it by less than half a sample in five
TONE, TONES = 0.1, 8  # of the largest, and how many of them an input has that repeats with the other sign
FEWEST = 2  # periods that must be there: fewer do not repeat


def find_period(u: FloatArray, shortest: int = 16) -> int | None:
    """Period of a (n,) input in samples, or None if it is not there twice.

    The first peak of the autocorrelation, checked and sharpened on the samples themselves.
    """
    signal = u - u.mean()
    number = signal.shape[0]
    power = float(np.dot(signal, signal))
    if number < FEWEST * shortest or power == 0.0:
        return None
    size = scipy.fft.next_fast_len(2 * number, real=True)
    correlation = scipy.fft.irfft(np.abs(scipy.fft.rfft(signal, size)) ** 2, size)[: number // FEWEST + 1]
    overlap = 1.0 - np.arange(correlation.shape[0]) / number
    alike = correlation / (power * overlap)
    below = np.flatnonzero(alike < 0.5)
    if below.size == 0:
        return None
    start = max(int(below[0]), shortest)
    peaks = np.flatnonzero(alike[start:] > LIKENESS - 0.05) + start
    if peaks.size == 0:
        return None
    near = np.arange(max(int(peaks[0]) - 2, 1), min(int(peaks[0]) + 64, number // FEWEST) + 1)
    exact = [likeness(signal, int(lag)) for lag in near]
    best = int(np.argmax(exact))
    return int(near[best]) if exact[best] > LIKENESS and _whole(signal, int(near[best])) else None


def find_half_period(u: FloatArray, shortest: int = 16) -> int | None:
    """Samples after which a (n,) input comes again with the other sign, as an odd multisine does after half its period; None if none is there twice.

    Of a few tones alone, like a sine, nothing is said: their half periods tell no more than windows do.
    """
    signal = u - u.mean()
    number, power = signal.shape[0], float(np.dot(signal, signal))
    if number < FEWEST * shortest or power == 0.0:
        return None
    size = scipy.fft.next_fast_len(2 * number, real=True)
    correlation = scipy.fft.irfft(np.abs(scipy.fft.rfft(signal, size)) ** 2, size)[: number // FEWEST + 1]
    alike = correlation / (power * (1.0 - np.arange(correlation.shape[0]) / number))
    half = int(np.argmin(alike[shortest:])) + shortest
    tones = _odd_lines(signal[:half])
    several = int(np.sum(tones > TONE * tones.max())) >= TONES
    return half if several and likeness(signal, half) < -LIKENESS else None


def one_more(u: FloatArray, y: FloatArray, period: int) -> tuple[FloatArray, FloatArray]:
    """Input and output (n,) of a periodic input with the sample that follows, by what followed a period before: the last difference needs it."""
    if u.shape[0] <= period:
        return u, y
    return np.append(u, u[-period]), np.append(y, y[-1] + y[-period] - y[-period - 1])


def half_periods(u: FloatArray, y: FloatArray, half: int, differenced: bool = True) -> list[tuple[int, FloatArray, FloatArray]]:
    """Each half period of input and output (n,) followed by its own negative: a whole period, in which nothing leaks.

    differenced: by the steps of the output, and with one sample more, as its differences need it
    The first is left out where more than two remain. Each is numbered as if they followed each other.
    """
    if not differenced:
        count = y.shape[0] // half
        parts = [slice(k * half, (k + 1) * half) for k in range(int(count > FEWEST), count)]
        return [(2 * part.start, np.concatenate((u[part], -u[part])), np.concatenate((y[part], -y[part]))) for part in parts]
    steps = np.append(np.diff(y), 0.0)
    count = u.shape[0] // half
    if u.shape[0] == count * half:
        steps[-1] = -steps[-1 - half]  # the step after the last sample, by its twin
    pieces = []
    for number in range(int(count > FEWEST), count):
        rows = slice(number * half, (number + 1) * half)
        inputs, moved = np.concatenate((u[rows], -u[rows], u[rows][:1])), np.concatenate((steps[rows], -steps[rows]))
        pieces.append((2 * half * number, inputs, np.concatenate(([0.0], np.cumsum(moved)))))
    return pieces


def _odd_lines(part: FloatArray) -> FloatArray:
    """Sizes of the odd lines of a period that is this part (n,) and its negative."""
    return np.asarray(np.abs(scipy.fft.rfft(np.concatenate((part, -part))))[1::2])


def _whole(signal: FloatArray, period: int) -> bool:
    """Whether the true period, by a parabola through the likeness of its neighbours, is this whole number of samples."""
    before, here, after = (likeness(signal, period + shift) for shift in (-1, 0, 1))
    bend = before - 2.0 * here + after
    return bend < 0.0 and abs(0.5 * (before - after) / bend) < OFF_WHOLE


def likeness(signal: FloatArray, lag: int) -> float:
    """Correlation of a (n,) signal of mean 0 with itself, lag samples later."""
    a, b = signal[:-lag], signal[lag:]
    return float(np.dot(a, b) / np.sqrt(np.dot(a, a) * np.dot(b, b)))


def period_note(u: FloatArray, period: int) -> list[str]:
    """What to say about a period that the user gives: it need not repeat perfectly, but it must lie in the (n,) input.

    Raises BadInput for a period longer than the input.
    """
    if period > u.shape[0]:
        raise BadInput("period", f"{period} samples", f"2 to {u.shape[0]}, the longest gap-free run", "Give the input's period, auto or none.")
    alike = likeness(u - u.mean(), period) if period < u.shape[0] else 1.0
    if alike > LIKENESS:
        return []
    return [f"The input does not repeat after {period} samples (correlation {alike:.2f}): a window of that length leaks."]
