"""Data of a figure for a long signal: few points that keep all extremes, a distribution, a spectrum, a drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording

POINTS = 1500  # bins of an envelope: about one per pixel of a wide screen
SPECTRUM_POINTS = 400
LONGEST_SEGMENT = 2**16  # samples of a segment for the power spectral density
EDGE = 0.1  # the band ends where the density falls below this fraction (-10 dB) of its level
EXCERPT = 500  # samples


@dataclass(frozen=True, slots=True)
class Density:
    """frequency (k,) Hz; density (k,) unit^2/Hz; low, high: edges of the band at -10 dB, Hz."""

    frequency: FloatArray
    density: FloatArray
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Excitation:
    """The input of one axis as figure 2 shows it.

    time, value: (k,) s and unit, an excerpt; rms, peak: of the full signal; the mean is removed from the rms
    centre, share: (bins,) unit and 1/unit, the distribution; density: its power spectral density
    """

    time: FloatArray
    value: FloatArray
    rms: float
    peak: float
    centre: FloatArray
    share: FloatArray
    density: Density


@dataclass(frozen=True, slots=True)
class Motion:
    """The output of one axis as figure 3 shows it.

    time, value: (k,) s and unit, an envelope that keeps every extreme, NaN in gaps
    drift: unit/s, slope of a straight line through all samples; offset: its value at time 0; low, high: extremes
    """

    time: FloatArray
    value: FloatArray
    drift: float
    offset: float
    low: float
    high: float


def envelope(time: FloatArray, value: FloatArray, bins: int = POINTS) -> tuple[FloatArray, FloatArray]:
    """(time, value) of the smallest and the largest sample of each of ``bins`` equal parts, in their order.

    At most 2 ``bins`` points; a shorter signal is returned unchanged.
    """
    size = value.shape[0]
    if size <= 2 * bins:
        return time, value
    edges = np.linspace(0, size, bins + 1).astype(np.int64)
    keep = np.empty(2 * bins, dtype=np.int64)
    for i in range(bins):
        piece = value[edges[i] : edges[i + 1]]
        first, second = sorted((int(np.argmin(piece)), int(np.argmax(piece))))
        keep[2 * i], keep[2 * i + 1] = edges[i] + first, edges[i] + second
    return time[keep], value[keep]


def motion(recording: Recording, axis: str, bins: int = POINTS) -> Motion:
    """The output of one axis, with its gaps and its drift; time starts at 0."""
    _, y = recording.axis(axis)
    time = recording.time - recording.time[0]
    times: list[FloatArray] = []
    values: list[FloatArray] = []
    for run in recording.runs():
        share = max(1, round(bins * (run.stop - run.start) / len(recording)))
        t, v = envelope(time[run], y[run], share)
        times += [t, t[-1:]]
        values += [v, np.array([np.nan])]
    middle = float(np.mean(time))
    spread = float(np.mean((time - middle) ** 2))
    drift = float(np.mean((time - middle) * y) / spread) if spread > 0 else 0.0
    offset = float(np.mean(y)) - drift * middle
    return Motion(time=np.concatenate(times), value=np.concatenate(values), drift=drift, offset=offset, low=float(np.min(y)), high=float(np.max(y)))


def excitation(recording: Recording, axis: str) -> Excitation:
    """The input of one axis: excerpt from the middle, distribution, power spectral density of the longest gap-free part."""
    u, _ = recording.axis(axis)
    run = recording.run(axis).rows
    middle = (run.start + run.stop) // 2
    excerpt = slice(max(run.start, middle - EXCERPT // 2), min(run.stop, middle + EXCERPT // 2))
    counts, edges = np.histogram(u, bins=61, density=True)
    width = float(edges[1] - edges[0])
    centres = np.concatenate(([edges[0] - 0.5 * width], 0.5 * (edges[1:] + edges[:-1]), [edges[-1] + 0.5 * width]))
    return Excitation(
        time=recording.time[excerpt] - recording.time[0],
        value=u[excerpt],
        rms=float(np.std(u)),
        peak=float(np.max(np.abs(u))),
        centre=centres,
        share=np.concatenate(([0.0], counts, [0.0])),
        density=density(u[run], recording.sampling_rate),
    )


def density(signal: FloatArray, sampling_rate: float) -> Density:
    """One-sided power spectral density (Welch, Hann), averaged in bins of equal width on a log axis."""
    segment = max(min(LONGEST_SEGMENT, signal.shape[0] // 4), min(16, signal.shape[0]))
    frequency, power = scipy.signal.welch(signal, sampling_rate, nperseg=segment)
    frequency, power = _log_bins(np.asarray(frequency)[1:], np.asarray(power)[1:])
    level = float(np.sum(power**2 * np.gradient(frequency)) / max(float(np.sum(power * np.gradient(frequency))), np.finfo(float).tiny))
    inside = np.flatnonzero((power >= EDGE * level) & (power > 0.0))
    low, high = (float(frequency[inside[0]]), float(frequency[inside[-1]])) if inside.size else (float("nan"),) * 2
    return Density(frequency, power, low, high)


def _log_bins(frequency: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray]:
    edges = np.geomspace(frequency[0], frequency[-1] * (1 + 1e-12), SPECTRUM_POINTS + 1)
    place = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, SPECTRUM_POINTS - 1)
    number = np.bincount(place, minlength=SPECTRUM_POINTS)
    used: NDArray[np.bool_] = number > 0
    mean_f = np.bincount(place, frequency, SPECTRUM_POINTS)[used] / number[used]
    mean_p = np.bincount(place, power, SPECTRUM_POINTS)[used] / number[used]
    return np.asarray(mean_f, dtype=np.float64), np.asarray(mean_p, dtype=np.float64)
