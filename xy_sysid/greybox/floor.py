"""The error in velocity, band by band, compared with the noise floor.

The error is cut into overlapping Hann windows; one line of one window is one number. With half overlap the windows add up to a
constant, so scaled by ``1 / sqrt(sum of window^2 per sample)`` the squares add up to those of the samples (Parseval), and
divided by the power density of the error they are the terms of a likelihood (Whittle 1953).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import as_sensed
from xy_sysid.units import Sensed

TOP = 700.0  # Hz; above, at 2 kHz, differences of an encoder's position are all noise
TOP_SHARE = 0.35  # limit of ``TOP`` for slow sampling, relative to the sampling rate
WINDOW = 2.0  # s, approximately: the lowest band is 1/2 Hz wide
NOISE_BAND = (0.6, 0.94)  # relative to Nyquist; its quietest twentieth counts as encoder noise, as harmonics of friction may reach into it
BINS, HARMONICS, SPARSE = 128, 16, 4  # of the spectrum of quantisation noise, from every fourth sample
POLES = 60  # number of tested rigid axes
SHORTEST, LONGEST = 16, 4096  # samples of a window for spectra, of short data and of the encoder noise
PARTS, SHORT = 8, 32  # windows for the noise of a sensor that is driven, and the least samples of one
TWENTIETH = 0.05  # relative to Nyquist: width of the parts of ``NOISE_BAND``
ROUNDING = 16.0  # times the rounding error of a position: smaller steps are none
MULTIPLES, OFF, NEARLY = 200.0, 1e-3, 0.9  # steps are multiples of a count up to this one, to this part, in this share of all
SEEN = 3.0  # a band is excited if the power of the measured velocity is this many times that of the encoder noise


@dataclass(frozen=True, slots=True)
class Bands:
    """Windows and bands of one sampling rate.

    length: samples of a window; band: (lines,) number of the band that each line of the spectrum up to the top is in
    sensed: the measured quantity; if it is an acceleration, spectra, powers and rms values are those of accelerations, in m/s^2
    """

    sampling_rate: float
    length: int
    band: NDArray[np.int64]
    count: int
    sensed: Sensed = "position"

    @property
    def amplitude(self) -> FloatArray:
        """(lines,) factor on the spectrum of a velocity: 1, or that of its difference if an acceleration is measured."""
        if self.sensed != "acceleration":
            return np.ones(self.band.size)
        return np.asarray(2.0 * np.sin(np.pi * self.frequency / self.sampling_rate) * self.sampling_rate)

    @property
    def frequency(self) -> FloatArray:
        """(lines,) Hz."""
        return np.asarray(np.arange(self.band.size) * self.sampling_rate / self.length)

    def edges(self) -> FloatArray:
        """(count + 1,) Hz: start of each band, and end of the last."""
        first = np.searchsorted(self.band, np.arange(self.count))
        return np.append(self.frequency[first], self.frequency[-1])

    def power(self, spectrum: ComplexArray) -> FloatArray:
        """(count,) power density of each band, as the variance per sample of white noise with this density, m^2/s^2."""
        with np.errstate(over="ignore", invalid="ignore"):  # a trial model may diverge
            lines = np.mean(spectrum.real**2 + spectrum.imag**2, axis=0)
        return np.asarray(np.bincount(self.band, lines, self.count) / self.lines)

    def powers(self, spectrum: ComplexArray) -> FloatArray:
        """(windows, count): the same for each window."""
        with np.errstate(over="ignore", invalid="ignore"):
            lines = spectrum.real**2 + spectrum.imag**2
            return np.asarray(np.add.reduceat(lines, np.searchsorted(self.band, np.arange(self.count)), axis=1) / self.lines)

    @property
    def lines(self) -> FloatArray:
        """(count,) number of lines in each band."""
        return np.bincount(self.band, minlength=self.count).astype(np.float64)

    def rms(self, power: FloatArray) -> float:
        """rms below the top frequency, m/s, of a power (count,)."""
        return float(np.sqrt(np.sum(self.lines * power) * 2.0 / self.length))


@dataclass(frozen=True, slots=True)
class Windows:
    """Some windows of a recording. layout: windows and bands; begins: (windows,) first sample of each."""

    layout: Bands
    begins: NDArray[np.int64]

    def spectrum(self, signal: FloatArray) -> ComplexArray:
        """(..., windows, lines) of signals (..., n) in m/s; squares add up to those of the samples, m^2/s^2."""
        length = self.layout.length
        if signal.shape[-1] < length:
            signal = np.concatenate((signal, np.zeros((*signal.shape[:-1], length - signal.shape[-1]))), axis=-1)
        cut, taper = np.empty((*signal.shape[:-1], self.begins.size, length)), _taper(length)
        for place, begin in enumerate(self.begins.tolist()):
            np.multiply(signal[..., begin : begin + length], taper, out=cut[..., place, :])
        found = np.asarray(scipy.fft.rfft(cut)[..., : self.layout.band.size])
        return found * self.layout.amplitude if self.layout.sensed == "acceleration" else found

    def covered(self, samples: int) -> NDArray[np.bool_]:
        """(samples,) True for samples in any of the windows."""
        inside = np.zeros(samples, dtype=np.bool_)
        for begin in self.begins:
            inside[begin : begin + self.layout.length] = True
        return inside

    @property
    def end(self) -> int:
        """Index after the last sample of the last window."""
        return int(self.begins[-1]) + self.layout.length if self.begins.size else 0


@cache
def _taper(length: int) -> FloatArray:
    """(length,) Hann window, scaled so that squares of a spectrum add up to those of the samples."""
    return np.asarray(np.sqrt(2.0 / 0.75 / length) * np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2)


def bands(sampling_rate: float, samples: int, count: int = 36, sensed: Sensed = "position") -> Bands:
    """Windows of about 2 s (less for short data) and at most ``count`` bands, logarithmically spaced."""
    wanted = min(WINDOW * sampling_rate, samples)
    length = 2 ** int(np.round(np.log2(max(wanted, SHORTEST))))
    top = min(TOP, TOP_SHARE * sampling_rate)
    last = max(int(top * length / sampling_rate), 2)
    edges = np.unique(np.round(np.geomspace(2.0, last + 1, count + 1)).astype(np.int64))
    band = np.maximum(np.searchsorted(edges, np.arange(last + 1), side="right") - 1, 0)
    return Bands(sampling_rate=sampling_rate, length=length, band=band, count=int(band[-1]) + 1, sensed=sensed)


@dataclass(frozen=True, slots=True)
class Floor:
    """The noise floor: the error of an exact model.

    noise:   (bands,) power of encoder noise, m^2/s^2, see ``Bands.power``; power: with the tolerated part of the motion
    motion:  (bands,) power of the measured velocity; excited: (bands,) bool
    encoder: rms of the sensor's white noise, in the unit of the measured quantity
    epsilon: assumed relative accuracy of laws and their integration; lines: (bands,) number of lines
    response: (bands,) |G|^2, (m/s/V)^2, of the machine to a force at the motor, which acts like its input
    """

    noise: FloatArray
    power: FloatArray
    motion: FloatArray
    excited: NDArray[np.bool_]
    encoder: float
    epsilon: float
    lines: FloatArray
    response: FloatArray


def encoder_noise(sampling_rate: float, position: FloatArray, sensed: Sensed = "position", driven_by: FloatArray | None = None) -> float:
    """rms of the sensor's white noise, from the quietest band below Nyquist; at least that of quantisation.

    sensed: the measured quantity, in whose unit the result is; position (n,), m, is the measurement or its integral
    driven_by: input (n,); the part of a velocity or acceleration that it explains is not noise, because such motion extends up to Nyquist
    """
    measured = as_sensed(position, sampling_rate, sensed)
    stationary = np.diff(position) * sampling_rate if sensed == "position" else measured
    length = min(LONGEST, stationary.size // 2 * 2)
    if sensed != "position" and driven_by is not None:
        length = min(length, 2 ** int(np.log2(max(stationary.size / PARTS, SHORT))), stationary.size // 2 * 2)
    windows = np.lib.stride_tricks.sliding_window_view(stationary, length)[:: length // 2] * np.hanning(length)
    spectrum = scipy.fft.rfft(windows, axis=1)
    power = np.mean(np.abs(spectrum) ** 2, axis=0)
    if sensed != "position" and driven_by is not None and windows.shape[0] > 2:
        inputs = np.lib.stride_tricks.sliding_window_view(driven_by[: stationary.size], length)[:: length // 2] * np.hanning(length)
        drive = scipy.fft.rfft(inputs - inputs.mean(axis=1, keepdims=True), axis=1)
        shared = np.abs(np.mean(spectrum * drive.conj(), axis=0)) ** 2 / np.maximum(np.mean(np.abs(drive) ** 2, axis=0), 1e-300)
        power = np.maximum(power - shared, 0.0) * windows.shape[0] / (windows.shape[0] - 1.0)
    power = power / np.sum(np.hanning(length) ** 2)
    share = np.arange(1, power.size) / (length / 2.0)  # without the mean, to which position noise adds nothing
    white = power[1:]
    if sensed == "position":
        white = white / np.maximum((2.0 * np.sin(0.5 * np.pi * share) * sampling_rate) ** 2, 1e-300)
    seen = [float(np.median(white[(share >= low) & (share < low + TWENTIETH)])) for low in np.arange(*NOISE_BAND, TWENTIETH)]
    return float(np.sqrt(max(min(seen), rounding_power(count_size(measured)))))


def rounding_power(count: float) -> float:
    """Power, m^2, of the error that rounding to whole counts makes (Widrow 1956); count: m."""
    return count**2 / 12.0


def count_size(position: FloatArray) -> float:
    """Resolution of the encoder, m: the smallest difference, if nearly all others are multiples of it; otherwise 0."""
    steps = np.abs(np.diff(position))
    steps = np.unique(steps[steps > 0.0])
    if steps.size == 0:
        return 0.0
    scale = float(np.max(np.abs(position))) + 1e-300
    least = float(steps[steps > ROUNDING * np.finfo(np.float64).eps * scale].min(initial=np.inf))
    if not np.isfinite(least):
        return 0.0
    whole = steps[steps < MULTIPLES * least] / least
    fits = np.abs(whole - np.round(whole)) < OFF * np.maximum(whole, 1.0)
    return least if whole.size >= 2 and float(np.mean(fits)) > NEARLY else 0.0


def floor(windows: Windows, velocity: FloatArray, encoder: float, epsilon: float, driven: FloatArray | None = None) -> Floor:
    """The floor of data with this measured velocity (n,), m/s. driven: (n,) V, its input; without it the response is 0."""
    layout = windows.layout
    unit = np.ones(layout.band.size)  # of the sensor's white noise, by line
    if layout.sensed == "position":
        unit = (2.0 * np.sin(np.pi * layout.frequency / layout.sampling_rate) * layout.sampling_rate) ** 2
    signal = layout.power(windows.spectrum(velocity))
    noise = np.bincount(layout.band, unit, layout.count) / layout.lines * encoder**2
    count = count_size(np.cumsum(velocity) / layout.sampling_rate) if layout.sensed == "position" else 0.0  # others count white
    if count > 0.0:
        seen = np.flatnonzero(signal > SEEN * noise)
        top = float(layout.edges()[(seen[-1] if seen.size else 0) + 1])
        counts = rounding_power(count) * counted(layout, velocity, count, top)
        noise = np.bincount(layout.band, unit * (max(encoder**2 - rounding_power(count), 0.0) + counts), layout.count) / layout.lines
    own = np.maximum(signal - noise, 0.0)
    around = np.concatenate(([own[0]], own, [own[-1]]))
    envelope = np.maximum(np.maximum(around[:-2], around[2:]), own)
    return Floor(
        noise=noise,
        power=noise + epsilon**2 * envelope,
        motion=own,
        excited=signal > SEEN * noise,
        encoder=encoder,
        epsilon=epsilon,
        lines=layout.lines,
        response=np.zeros(layout.count) if driven is None else _response(windows, velocity, driven),
    )


def _response(windows: Windows, velocity: FloatArray, driven: FloatArray) -> FloatArray:
    """(bands,) |G|^2: measured where input and output are coherent, elsewhere that of the rigid axis that predicts the motion best.

    In a closed loop that follows a smooth path, friction makes the input broadband while the motion stays smooth: the estimate H1 (Bendat &
    Piersol, Random Data, 4th ed., sec. 6.1) is then far too small. The result is the geometric mean of both, weighted by the coherence.
    """
    layout = windows.layout
    force, moved = windows.spectrum(driven), windows.spectrum(velocity)
    cross, own, all_of_it = np.mean(force.conj() * moved, axis=0), np.mean(np.abs(force) ** 2, axis=0), np.mean(np.abs(moved) ** 2, axis=0)

    def banded(lines: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(np.bincount(layout.band, lines, layout.count), 1e-300))

    def rigid(pole: float) -> tuple[float, FloatArray]:
        """Power of the motion that an axis with this pole predicts, and (lines,) power of its response; phase is ignored (unknown delay)."""
        answer = 1.0 / (1.0 + 2j * np.pi * layout.frequency / pole)
        seen, size = abs(np.sum(answer.conj() * cross)), max(float(np.sum(np.abs(answer) ** 2 * own)), 1e-300)
        return seen**2 / size, (seen / size * np.abs(answer)) ** 2

    poles = 2.0 * np.pi * np.geomspace(0.1 * layout.frequency[1], 10.0 * layout.frequency[-1], POLES)
    _, best = max((rigid(pole) for pole in poles.tolist()), key=lambda item: item[0])
    coherence = banded(np.abs(cross) ** 2) / banded(own * all_of_it)
    measured, assumed = banded(np.abs(cross) ** 2) / banded(own**2), banded(best) / layout.lines
    return np.asarray(measured**coherence * assumed ** (1.0 - coherence) * banded(layout.amplitude**2) / layout.lines)


def counted(layout: Bands, velocity: FloatArray, count: float, top: float) -> FloatArray:
    """(lines,) power density of quantisation noise at this velocity (n,), m/s, relative to white noise.

    Quantisation error is a sawtooth of the position: its harmonics k, with 1/k^2 of the power, have k times the rate at which
    counts are passed, folded at Nyquist (Bennett, Spectra of quantized signals, Bell Syst. Tech. J. 27, 1948). With many counts
    per sample it is white; with few, it is much larger below that rate and nearly 0 above. top: Hz, highest frequency of the motion.
    """
    if top < TOP_SHARE * layout.sampling_rate:
        velocity = scipy.signal.sosfiltfilt(scipy.signal.butter(4, top, fs=layout.sampling_rate, output="sos"), velocity)
    rate = np.abs(velocity[::SPARSE]) / (count * layout.sampling_rate)  # counts per sample
    power = np.zeros(BINS)
    for k in range(1, HARMONICS + 1):
        folded = np.abs(k * rate - np.round(k * rate))
        power += np.bincount(np.minimum((2.0 * BINS * folded).astype(np.int64), BINS - 1), minlength=BINS) / k**2
    density = power * BINS * 6.0 / np.pi**2 / rate.size
    density += 1.0 - float(density.mean())  # higher harmonics
    turns = float(np.std(np.diff(velocity)) / (np.pi * max(float(np.std(velocity)), 1e-300)))  # how fast the rate itself changes, over Nyquist
    density = scipy.ndimage.gaussian_filter1d(density, turns * BINS, mode="reflect")
    place = np.minimum((2.0 * BINS * layout.frequency / layout.sampling_rate).astype(np.int64), BINS - 1)
    return np.asarray(density[place])


def tolerance(layout: Bands, error: ComplexArray, least: Floor) -> FloatArray:
    """(bands,) m^2/s^2, power by which squared errors (a spectrum of them) are divided if the residual error is systematic.

    Residual error above the floor is treated as one common error of each band (like Kennedy & O'Hagan 2001
    for model discrepancy), which does not average out over the band's lines. So at the floor every line counts, and far above
    it each band counts once, wide or narrow.
    """
    return np.asarray(least.power + layout.lines * np.maximum(layout.power(error) - least.power, 0.0))
