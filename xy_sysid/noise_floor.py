"""What the data themselves allow: the error that a perfect model would still show in velocity, by frequency.

Floor = encoder noise, read where nothing moves (the highest frequencies), shaped by the difference
|2 sin(pi f / fs)|^2 fs^2, plus (EPSILON times the signal)^2: no real axis repeats itself better than that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from xy_sysid.stream import FloatArray

EPSILON = 1e-3  # of the signal's own spectrum
QUIET_BAND = (0.75, 0.95)  # of the Nyquist frequency: here the encoder's noise is read
SEGMENT = 4096  # samples of a spectrum, or an eighth of the data if they are short
BANDS = 36  # log-spaced bands of the comparison
HIGHEST = 0.35  # of the sampling rate


@dataclass(frozen=True, slots=True)
class Bands:
    """Log-spaced bands of frequency.

    edges: (n + 1,) Hz; which: (lines,) band of each line of the spectrum, -1 outside; frequency: (lines,) Hz
    """

    edges: FloatArray
    which: np.ndarray
    frequency: FloatArray

    def mean(self, spectrum: FloatArray) -> FloatArray:
        """(n,) mean of a (lines,) spectrum over each band; bands without a line are nan."""
        inside = self.which >= 0
        total = np.bincount(self.which[inside], weights=spectrum[inside], minlength=len(self.edges) - 1)
        count = np.bincount(self.which[inside], minlength=len(self.edges) - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(total / count, dtype=np.float64)


def segment(samples: int) -> int:
    """Length of the spectra's windows for so many samples."""
    return int(min(SEGMENT, max(samples // 8, 16)))


def bands(samples: int, sampling_rate: float) -> Bands:
    """Bands for velocities of so many samples."""
    frequency = np.fft.rfftfreq(segment(samples), 1.0 / sampling_rate)
    edges = np.geomspace(1.5 * frequency[1], HIGHEST * sampling_rate, BANDS + 1)
    which = np.where((frequency >= edges[0]) & (frequency < edges[-1]), np.searchsorted(edges, frequency, side="right") - 1, -1)
    return Bands(np.asarray(edges, dtype=np.float64), which, np.asarray(frequency, dtype=np.float64))


def density(values: FloatArray, sampling_rate: float) -> FloatArray:
    """(lines,) one-sided power spectral density, constant part kept out, Hann."""
    _, found = signal.welch(values, sampling_rate, "hann", segment(values.shape[0]), detrend="constant")
    return np.asarray(found, dtype=np.float64)


def floor_density(position: FloatArray, velocity_model: FloatArray, sampling_rate: float) -> FloatArray:
    """(lines,) density of the floor in velocity, (m/s)^2/Hz.

    position: (n + 1,) measured; velocity_model: (n,) what the model says
    """
    measured = density(np.diff(position) * sampling_rate, sampling_rate)
    frequency = np.fft.rfftfreq(2 * (measured.shape[0] - 1), 1.0 / sampling_rate)
    shape = (2.0 * np.sin(np.pi * frequency / sampling_rate) * sampling_rate) ** 2
    quiet = (frequency >= QUIET_BAND[0] * sampling_rate / 2) & (frequency <= QUIET_BAND[1] * sampling_rate / 2)
    noise = float(np.median(measured[quiet] / shape[quiet])) / np.log(2.0) if bool(quiet.any()) else 0.0
    return np.asarray(noise * shape + EPSILON**2 * density(velocity_model, sampling_rate), dtype=np.float64)
