"""The figure data of one fit as short rows of numbers: frequency response, places of the error, and the signals in time.

Measured data are stored once (``Measured``); each fit adds its own part (``Pictures``). The model's response comes from its
simulated motion through the same windows as the measured one, so that friction affects both in the same way.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.axis.linear_part import linear_part
from xy_sysid.comparison.residual_correlation import ResidualCorrelation, residual_correlation
from xy_sysid.comparison.where_it_fails import Comparison, Place, Unseen, compare_motion
from xy_sysid.errors import BadInput
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.greybox.one_step import AT_NOISE
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.frf import Z95, ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response, main_lobe
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray

POINTS = 160  # of a frequency response
BUCKETS = 300  # of a signal in time
SPEED_BINS, POSITION_BINS, TIME_BINS = 24, 60, 30
ZOOM, ZOOM_MOST = 0.5, 600  # s, samples
WINDOW = 2.0  # s
SHORTEST, PARTS = 16.0, 4.0  # samples of such a window, and windows, at least
FAINTEST = 0.03  # of a magnitude: lower end of its band, so that it has a logarithm
SMOOTH = 0.002  # s, over which an error is averaged to find the largest
SETTLING = 0.5  # s in which the simulation may still start from rest
TOP = 0.45  # of the sampling rate


@dataclass(frozen=True, slots=True)
class Measured:
    """The measured data, shared by all fits.

    frequency: (m,) Hz, log-spaced; magnitude, magnitude_low, magnitude_high: dB (m/V) with 95 % band; phase...: degrees
    coherence: (m,); trusted: (m,) bool: excited and coherent
    time: (k,) s, middle of each bin, without gaps; velocity_low, velocity_high: (k,) m/s, minimum and maximum; position: (k,) m, mean
    zoom_start: s; zoom_voltage, zoom_velocity: samples around the base's largest error
    held_out: (from, to), s, of each stretch of held-out data. A fit with one-step prediction holds out only the data from ``ahead`` on
    """

    frequency: FloatArray
    magnitude: FloatArray
    magnitude_low: FloatArray
    magnitude_high: FloatArray
    phase: FloatArray
    phase_low: FloatArray
    phase_high: FloatArray
    coherence: FloatArray
    trusted: NDArray[np.bool_]
    time: FloatArray
    velocity_low: FloatArray
    velocity_high: FloatArray
    position: FloatArray
    held_out: tuple[tuple[float, float], ...]
    ahead: float
    zoom_start: float
    zoom_voltage: FloatArray
    zoom_velocity: FloatArray


@dataclass(frozen=True, slots=True)
class Binned:
    """The error in bins of a variable: centre of each bin, rms error divided by the noise floor, and mean error, m/s."""

    centre: FloatArray
    over_floor: FloatArray
    mean: FloatArray


@dataclass(frozen=True, slots=True)
class Pictures:
    """The figure data of one fit.

    magnitude, phase: (m,) dB, degrees, at ``Measured.frequency``; linear: its linear part
    band, band_error: (b,) Hz, rms error over the noise floor on unseen data; band_end: Hz where signal meets floor
    failing: places where it fails, worst first
    speed, place, time: error by velocity (with its sign), by position, and by time
    correlation: of the error with itself and with the voltage; None with too few samples
    velocity_low, velocity_high, position: as of ``Measured``, simulated; zoom_velocity: the same samples
    """

    magnitude: FloatArray
    phase: FloatArray
    linear: TransferFunction
    band: FloatArray
    band_error: FloatArray
    band_end: float
    failing: tuple[Place, ...]
    speed: Binned
    place: Binned
    time: Binned
    correlation: ResidualCorrelation | None
    velocity_low: FloatArray
    velocity_high: FloatArray
    position: FloatArray
    zoom_velocity: FloatArray


def measured(data: AxisData, base: GreyboxFit) -> Measured:
    """The measured data; the zoom is at the largest error of the rigid model."""
    response, weight, point = _points(data)
    whole, sigma = _mean_response(response, weight, point), _sigma(response, weight, point)
    size = np.abs(whole)
    spread = Z95 * sigma / np.sqrt(2.0)  # of one component of the complex error
    coherence = _mean(response.coherence, np.ones_like(weight), point)
    trusted = _mean(response.trusted.astype(np.float64), np.ones_like(weight), point) > 0.5
    phase = _unwrapped(np.degrees(np.angle(whole)), trusted)
    turn = np.degrees(np.arcsin(np.minimum(spread / np.maximum(size, 1e-300), 1.0)))
    low, most = _extremes(data.velocity)
    start, stop = _zoom(data, base)
    return Measured(
        frequency=_mean(response.frequency, np.ones_like(weight), point),
        magnitude=_db(size),
        magnitude_low=_db(np.maximum(size - spread, FAINTEST * size)),
        magnitude_high=_db(size + spread),
        phase=phase,
        phase_low=phase - turn,
        phase_high=phase + turn,
        coherence=coherence,
        trusted=trusted,
        time=_means(np.arange(data.velocity.size) / data.sampling_rate),
        velocity_low=low,
        velocity_high=most,
        position=_means(data.begins(data.position)),
        held_out=_stretches(data),
        ahead=data.training / data.sampling_rate,
        zoom_start=start / data.sampling_rate,
        zoom_voltage=data.begins(data.voltage)[start:stop].copy(),
        zoom_velocity=data.velocity[start:stop].copy(),
    )


def pictures(data: AxisData, fitted: GreyboxFit, shown: Measured) -> Pictures:
    """The figure data of one fit. The bins are scaled so that their mean power matches held-out error divided by floor."""
    travelled = (np.concatenate(([0.0], np.cumsum(fitted.simulated[step]))) / data.sampling_rate for step in data.steps)
    position = np.concatenate([data.position[run.start] + way for run, way in zip(data.runs, travelled, strict=True)])
    _, weight, point = _points(data)
    response = _mean_response(_response(data, position), weight, point)
    compared = _compared(data, fitted)
    end = compared.band_end
    error, speed = (_below(values, end, data.sampling_rate) for values in (fitted.error, data.velocity))
    unseen = np.arange(error.size) >= data.training if fitted.one_step else data.held_samples()
    noise = max(_rms(error[unseen]) * compared.noise_floor / max(compared.error, 1e-300), 1e-300)
    time = np.asarray((np.arange(error.size) + 0.5) / data.sampling_rate, dtype=np.float64)
    known = np.isfinite(compared.error_over_floor)  # narrow bands may contain no line
    low, most = _extremes(fitted.simulated)
    first = round(shown.zoom_start * data.sampling_rate)
    return Pictures(
        magnitude=_db(np.abs(response)),
        phase=shown.phase + (np.degrees(np.angle(response)) - shown.phase + 180.0) % 360.0 - 180.0,
        linear=linear_part(fitted.model, data.units),
        band=compared.frequency[known],
        band_error=compared.error_over_floor[known],
        band_end=end,
        failing=compared.places,
        speed=_binned(speed, error, noise, SPEED_BINS),
        place=_binned(data.begins(data.position), error, noise, POSITION_BINS),
        time=_binned(time, error, noise, TIME_BINS),
        correlation=_correlation(data, fitted),
        velocity_low=low,
        velocity_high=most,
        position=_means(data.begins(position)),
        zoom_velocity=fitted.simulated[first : first + shown.zoom_velocity.size].copy(),
    )


def _compared(data: AxisData, fitted: GreyboxFit) -> Comparison:
    """The comparison on held-out samples; only by bands if there are few samples.

    A model that is judged by one-step prediction fails only where its error is above ``AT_NOISE``.
    """
    first = data.training if fitted.one_step else 0
    unseen = Unseen(
        voltage=data.voltage[first:],
        position=data.position[first:],
        sampling_rate=data.sampling_rate,
        units=data.units,
        begins=first / data.sampling_rate,
        encoder=data.floor.encoder,
        held=None if fitted.one_step else (data.held_out, data.floor),
        starts=(0,) if fitted.one_step else data.starts,
    )
    with contextlib.suppress(BadInput):
        found = compare_motion(fitted.simulated[first:], unseen)
        return replace(found, places=tuple(place for place in found.places if not fitted.one_step or place.error_over_floor > AT_NOISE))
    edges = data.layout.edges()
    ratio = np.sqrt(fitted.power / np.maximum(data.floor.power, 1e-300))
    nothing = np.zeros(0)
    return Comparison(
        time=nothing,
        measured=nothing,
        predicted=nothing,
        position=nothing,
        motion=data.layout.rms(data.floor.motion),
        error=fitted.held_out_error,
        noise_floor=data.noise_floor,
        error_below_end=fitted.held_out_error,
        floor_below_end=data.noise_floor,
        band_end=float(edges[-1]),
        unit=data.units.judged,
        frequency=np.sqrt(np.maximum(edges[:-1], 0.5 * edges[1]) * edges[1:]),
        error_over_floor=ratio,
        places=(),
    )


def _stretches(data: AxisData) -> tuple[tuple[float, float], ...]:
    """(from, to), s, of each stretch of held-out samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], data.held_samples().astype(np.int8), [0])))) / data.sampling_rate
    return tuple((float(first), float(last)) for first, last in zip(edges[::2], edges[1::2], strict=True))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _correlation(data: AxisData, fitted: GreyboxFit) -> ResidualCorrelation | None:
    try:
        return residual_correlation(fitted.error, data.begins(data.voltage))
    except BadInput:
        return None


def _below(values: FloatArray, end: float, sampling_rate: float) -> FloatArray:
    """The part below ``end`` Hz."""
    if end >= TOP * sampling_rate:
        return values
    return np.asarray(scipy.signal.oaconvolve(values, scipy.signal.firwin(257, end, fs=sampling_rate), mode="same"), dtype=np.float64)


def _response(data: AxisData, position: FloatArray) -> FrequencyResponse:
    longest = max(run.stop - run.start for run in data.runs)
    length = 2 ** int(np.log2(max(min(WINDOW * data.sampling_rate, longest / PARTS), SHORTEST)))
    shape = WindowShape.of("hann", length, 0.5)
    firsts = np.cumsum([0, *(-(-(run.stop - run.start) // shape.hop) * shape.hop for run in data.runs)])  # each starts with a window
    runs = [(int(first), data.voltage[run], position[run]) for first, run in zip(firsts, data.runs, strict=False)]
    spectra = batch_spectra(runs, shape, differenced=True)
    return frequency_response(spectra, shape, data.sampling_rate, H1Options(differenced=True, band=(0.0, TOP * data.sampling_rate)))


def _points(data: AxisData) -> tuple[FrequencyResponse, FloatArray, NDArray[np.int64]]:
    """The measured response, the weight of each line, and the index of its figure point."""
    response = _response(data, data.position)
    f = response.frequency
    edges = np.geomspace(f[0], f[-1] * 1.000001, POINTS + 1)
    _, point = np.unique(np.searchsorted(edges, f, side="right"), return_inverse=True)
    certain = np.isfinite(response.sigma) & (response.sigma > 0.0)
    weight = np.where(certain, 1.0 / np.maximum(np.where(certain, response.sigma, 1.0), 1e-12 * np.abs(response.response) + 1e-300) ** 2, 1.0)
    reach = main_lobe(WindowShape.of("hann", 16, 0.5))
    weight[: reach - 1] *= 1e-6  # lines biased by the removed mean
    return response, weight, np.asarray(point, dtype=np.int64)


def _mean(values: FloatArray, weight: FloatArray, point: NDArray[np.int64]) -> FloatArray:
    return np.asarray(np.bincount(point, weight * values) / np.bincount(point, weight))


def _mean_response(response: FrequencyResponse, weight: FloatArray, point: NDArray[np.int64]) -> ComplexArray:
    return np.asarray(_mean(response.response.real, weight, point) + 1j * _mean(response.response.imag, weight, point))


def _sigma(response: FrequencyResponse, weight: FloatArray, point: NDArray[np.int64]) -> FloatArray:
    """Sigma of each point's mean; errors of neighbouring lines are correlated."""
    total = np.bincount(point, weight)
    many = np.bincount(point) > 1
    alike = 1.0 + 2.0 * float(np.sum(response.line_correlation[1:]))
    sigma = np.where(np.isfinite(response.sigma), response.sigma, np.abs(response.response))
    return np.asarray(np.sqrt(np.bincount(point, (weight * sigma) ** 2) * np.where(many, alike, 1.0)) / total)


def _unwrapped(phase: FloatArray, trusted: NDArray[np.bool_]) -> FloatArray:
    """The phase without jumps of 360 degrees along the trusted points; the others are placed near them."""
    if int(trusted.sum()) < 2:
        return phase
    place = np.arange(phase.size)
    smooth = np.unwrap(phase[trusted], period=360.0)
    around = np.interp(place, place[trusted], smooth)
    return np.asarray(around + (phase - around + 180.0) % 360.0 - 180.0)


def _db(size: FloatArray) -> FloatArray:
    return np.asarray(20.0 * np.log10(np.maximum(size, 1e-300)))


def _edges(samples: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, samples, min(BUCKETS, samples) + 1).astype(np.int64))


def _extremes(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    starts = _edges(values.size)[:-1]
    return np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)


def _means(values: FloatArray) -> FloatArray:
    edges = _edges(values.size)
    return np.asarray(np.add.reduceat(values, edges[:-1]) / np.diff(edges))


def _zoom(data: AxisData, base: GreyboxFit) -> tuple[int, int]:
    """The samples around the largest error that is not encoder noise."""
    width = min(int(ZOOM * data.sampling_rate), ZOOM_MOST, min(step.stop - step.start for step in data.steps))
    smooth = max(int(SMOOTH * data.sampling_rate), 1)
    power = scipy.signal.oaconvolve(base.error, np.full(smooth, 1.0 / smooth), mode="same") ** 2
    skip = min(int(SETTLING * data.sampling_rate), power.size // 4)
    worst = skip + int(np.argmax(power[skip:]))
    within = next(step for step in data.steps if worst < step.stop)  # within one recording
    start = min(max(worst - width // 2, within.start), within.stop - width)
    return start, start + width


def _binned(by: FloatArray, error: FloatArray, noise: float, number: int) -> Binned:
    """Bins with the same number of samples in each."""
    edges = np.unique(np.quantile(by, np.linspace(0.0, 1.0, number + 1)))
    which = np.clip(np.searchsorted(edges, by, side="right") - 1, 0, max(edges.size - 2, 0))
    count = np.bincount(which)
    used = count > 0
    centre, power, mean = (np.asarray(np.bincount(which, values)[used] / count[used]) for values in (by, error**2, error))
    return Binned(centre, np.sqrt(power) / noise, mean)
