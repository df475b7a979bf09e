"""Gain, delay and pole of a rigid axis from its frequency response, without a start value.

For each pole, delay and gain follow from complex correlations with the response; the pole with the smallest
residual is chosen. The model is the exact response of the mean velocity per sample behind a zero-order hold.
"""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.samples.block import FloatArray

POLES = np.geomspace(3.0, 5000.0, 80)  # rad/s
FEWEST_LINES = 16.0  # least samples of a window, for low sampling rates or short data
SURE = 0.9999  # a coherence counts as no more, or one line would decide
HIGHEST = 0.35  # of the sampling rate: lines of a frequency response
WEAKEST = 1e-3  # power of a line of the input over the largest
PARTS = 4.0  # windows at least
LONGEST_DELAY = 40  # samples; a longer delay needs a start value


def mean_velocity_filter(gain: float, pole: float, sampling_rate: float) -> tuple[FloatArray, FloatArray]:
    """(b, a) in powers of 1/z from a held voltage to the mean velocity of each sample, without delay."""
    period = 1.0 / sampling_rate
    decay = np.exp(-pole * period)
    spent = -np.expm1(-pole * period) / pole
    through = gain * (period - spent) * sampling_rate
    return np.array([through, gain * (1.0 - decay) * spent * sampling_rate - decay * through]), np.array([1.0, -decay])


def base_start(sampling_rate: float, voltage: FloatArray, velocity: FloatArray) -> tuple[float, float, float]:
    """(gain m/s/V, delay s, pole rad/s) from a held voltage (n,) and the mean velocity of each sample (n,)."""
    length = int(2 ** np.floor(np.log2(max(min(2.0 * sampling_rate, voltage.size / PARTS), FEWEST_LINES))))
    frequency, cross = scipy.signal.csd(voltage, velocity, sampling_rate, "hann", length)
    power = scipy.signal.welch(voltage, sampling_rate, "hann", length)[1]
    output = scipy.signal.welch(velocity, sampling_rate, "hann", length)[1]
    response = cross / np.maximum(power, 1e-300)
    coherence = np.clip(np.abs(cross) ** 2 / np.maximum(power * output, 1e-300), 0.0, SURE)
    used = (frequency > 0.0) & (frequency < HIGHEST * sampling_rate)
    f, measured = frequency[used], response[used]
    weight = coherence[used] / (1.0 - coherence[used]) / np.maximum(np.abs(measured) ** 2, 1e-300)
    weight *= power[used] > WEAKEST * np.max(power)
    turn = 2j * np.pi * f / sampling_rate
    delays = np.arange(0.0, LONGEST_DELAY, 0.1)
    shift = np.exp(np.outer(turn, delays))  # (lines, delays)
    best = (np.inf, 0.0, 0.0, 1.0)
    whole = float(np.sum(weight * np.abs(measured) ** 2))
    for pole in POLES:
        b, a = mean_velocity_filter(1.0, float(pole), sampling_rate)
        unit = (b[0] + b[1] * np.exp(-turn)) / (a[0] + a[1] * np.exp(-turn))
        fitted = np.real((weight * measured * np.conj(unit)) @ shift)
        size = float(np.sum(weight * np.abs(unit) ** 2))
        place = int(np.argmax(np.abs(fitted)))
        left = whole - float(fitted[place]) ** 2 / size
        if left < best[0]:
            best = (left, float(fitted[place]) / size, float(delays[place]) / sampling_rate, float(pole))
    return best[1], best[2], best[3]
