"""Does the input repeat? Then a window of one period has no leakage, and lines between the excited ones are noise."""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

LIKENESS = 0.98  # least correlation of the input with itself one period later; measured inputs have some noise
OFF_WHOLE = 0.1  # of a sample: largest error of the period; over five windows less than half a sample
TONE, TONES = 0.1, 8  # least size of a tone relative to the largest, and least number of tones for half periods
FEWEST = 2  # least periods
SHORTEST = 16  # samples of a period


def find_period(u: FloatArray) -> int | None:
    """Period of a (n,) input in samples, or None if there are fewer than two.

    It is the first peak of the autocorrelation, checked and refined on the samples.
    """
    signal = u - u.mean()
    alike = _likenesses(signal)
    below = np.flatnonzero(alike < 0.5)
    if below.size == 0:
        return None
    start = max(int(below[0]), SHORTEST)
    peaks = np.flatnonzero(alike[start:] > LIKENESS - 0.05) + start
    if peaks.size == 0:
        return None
    near = np.arange(max(int(peaks[0]) - 2, 1), min(int(peaks[0]) + 64, signal.shape[0] // FEWEST) + 1)
    exact = [likeness(signal, int(lag)) for lag in near]
    best = int(np.argmax(exact))
    return int(near[best]) if exact[best] > LIKENESS and _whole(signal, int(near[best])) else None


def find_half_period(u: FloatArray) -> int | None:
    """Samples after which a (n,) input repeats with the opposite sign, as an odd multisine after half its period; None if there are fewer than two.

    None also for an input of a few tones, like a sine: for these half periods are no better than windows.
    """
    signal = u - u.mean()
    alike = _likenesses(signal)
    if alike.size == 0:
        return None
    half = int(np.argmin(alike[SHORTEST:])) + SHORTEST
    tones = np.abs(scipy.fft.rfft(np.concatenate((signal[:half], -signal[:half]))))[1::2]  # odd lines of the whole period
    several = int(np.sum(tones > TONE * tones.max())) >= TONES
    return half if several and likeness(signal, half) < -LIKENESS else None


def _likenesses(signal: FloatArray) -> FloatArray:
    """Correlation of a (n,) signal of mean 0 with itself 0, 1, .. n / FEWEST samples later; (0,) for one that is too short or constant."""
    number, power = signal.shape[0], float(np.dot(signal, signal))
    if number < FEWEST * SHORTEST or power == 0.0:
        return np.zeros(0)
    size = scipy.fft.next_fast_len(2 * number, real=True)
    correlation = scipy.fft.irfft(np.abs(scipy.fft.rfft(signal, size)) ** 2, size)[: number // FEWEST + 1]
    return np.asarray(correlation / (power * (1.0 - np.arange(correlation.shape[0]) / number)))


def one_more(u: FloatArray, y: FloatArray, period: int) -> tuple[FloatArray, FloatArray]:
    """Periodic input and its output (n,) with one more sample, extrapolated from the period before: the last difference needs it."""
    if u.shape[0] <= period:
        return u, y
    return np.append(u, u[-period]), np.append(y, y[-1] + y[-period] - y[-period - 1])


def half_periods(u: FloatArray, y: FloatArray, half: int, differenced: bool) -> list[tuple[int, FloatArray, FloatArray]]:
    """(counter, input, output) of each half period (n,) followed by its negative: a whole period without leakage.

    differenced: True to negate the steps of the output instead, with one more sample for its differences
    The first is left out if there are more than two. Counters are those of consecutive periods.
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


def _whole(signal: FloatArray, period: int) -> bool:
    """Whether the true period, by a parabola through the correlations at neighbouring lags, is this whole number of samples."""
    before, here, after = (likeness(signal, period + shift) for shift in (-1, 0, 1))
    bend = before - 2.0 * here + after
    return bend < 0.0 and abs(0.5 * (before - after) / bend) < OFF_WHOLE


def likeness(signal: FloatArray, lag: int) -> float:
    """Correlation of a (n,) signal of mean 0 with itself ``lag`` samples later."""
    a, b = signal[:-lag], signal[lag:]
    return float(np.dot(a, b) / np.sqrt(np.dot(a, a) * np.dot(b, b)))


def period_note(u: FloatArray, period: int) -> list[str]:
    """Notes on a period given by the user, samples: one if the (n,) input does not repeat after it.

    Raises BadInput for a period longer than the input.
    """
    if period > u.shape[0]:
        raise BadInput("period", f"{period} samples", f"2 to {u.shape[0]}, the longest gap-free run", "Give the input's period, auto or none.")
    alike = likeness(u - u.mean(), period) if period < u.shape[0] else 1.0
    if alike > LIKENESS:
        return []
    return [f"The input does not repeat after {period} samples (correlation {alike:.2f}): a window of that length leaks."]
