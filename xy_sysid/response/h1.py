"""From spectra to the frequency response: the H1 estimator, its coherence, its sigma and its trusted lines.

H1 = Gyx / Gxx; sigma^2 = (Gyy - |Gyx|^2 / Gxx) / Gxx / (averages - 1) is the variance of the complex error.
(Bendat & Piersol, Random Data, 4th ed., eq. 6.37 and 9.90; Pintelon & Schoukens, System Identification, 2nd ed., sec. 2.5)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.spectra import Spectra
from xy_sysid.response.windows import WindowShape, blur_kernel, error_correlation
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import LEAST_COHERENCE

NOISE_SMOOTHING = 2  # lines to each side over which the noise power is averaged: it stabilises sigma if windows are few
PERIODIC_COHERENCE = 0.9  # a line of a periodic input has a high coherence; a low one is feedback or noise between the excited lines
MARGIN = 8  # lines outside the band that its lines need (smoothing, main lobe)
STRONG = 0.9  # quantile of the input power in the band that counts as strong
EXCITED = 1e-3  # a line is excited if its input power is above this fraction of the strong lines' power


def main_lobe(shape: WindowShape) -> int:
    """Half width of the taper's main lobe in lines; closer to 0 Hz the removed mean biases an estimate."""
    return {"boxcar": 1, "hann": 2, "hamming": 2, "blackman": 3, "blackmanharris": 4, "flattop": 5}.get(shape.name, 4)


@lru_cache(maxsize=8)
def _kernel(shape: WindowShape) -> FloatArray:
    kernel = blur_kernel(shape)
    kernel.setflags(write=False)
    return kernel


def divisor(frequency: FloatArray, sampling_rate: float) -> ComplexArray:
    """(m,) response of the forward difference y[n + 1] - y[n], exp(j w T) - 1."""
    return np.asarray(np.expm1(2j * np.pi * frequency / sampling_rate), dtype=np.complex128)


@dataclass(frozen=True, slots=True)
class H1Options:
    """Options of the estimate.

    differenced:   True if the spectra are of the output's forward difference, not of the output itself
    periodic:      True if the window is an integer number of periods of the input: there is no leakage, and only the excited lines
                   have information
    band:          (low, high) Hz
    min_coherence: least coherence of a trusted line
    units:         of input and output
    rate_error:    relative standard error of the sampling rate
    repeated:      least coherence of a trusted line of a periodic input; 0 for a periodic reference, which feedback does not affect
    """

    differenced: bool
    periodic: bool = False
    band: tuple[float, float] = (0.0, np.inf)
    min_coherence: float = LEAST_COHERENCE
    units: tuple[str, str] = ("V", "m")
    repeated: float = PERIODIC_COHERENCE
    rate_error: float = 0.0


def frequency_response(spectra: Spectra, shape: WindowShape, sampling_rate: float, options: H1Options) -> FrequencyResponse:
    """The response of one axis at the lines inside the band, except 0 Hz.

    With fewer than two effective averages sigma is infinite and no line is trusted.
    """
    band, periodic = options.band, options.periodic
    length = spectra.gxx.shape[0]
    every = np.arange(length) * sampling_rate / shape.length
    chosen = np.flatnonzero((every > 0) & (every >= band[0]) & (every <= min(band[1], 0.5 * sampling_rate)))
    first, last = (int(chosen[0]), int(chosen[-1]) + 1) if chosen.size else (0, 0)
    near = slice(max(first - MARGIN, 0), min(last + MARGIN, length))
    inside = slice(first - near.start, last - near.start)
    frequency = every[near]
    gxx, gyy, gyx = spectra.gxx[near], spectra.gyy[near], spectra.gyx[near]
    power = np.maximum(gxx, np.finfo(float).tiny)
    response = gyx / power
    unexplained = np.maximum(gyy - np.abs(gyx) ** 2 / power, 0.0)
    coherence = np.clip(1.0 - unexplained / np.maximum(gyy, np.finfo(float).tiny), 0.0, 1.0)
    excited = _excited(gxx, inside, 0 if periodic else main_lobe(shape))
    if not periodic:
        unexplained = smoothed(unexplained, 2 * NOISE_SMOOTHING + 1)
        excited &= np.arange(near.start, near.stop) >= main_lobe(shape)
    averages = spectra.averages
    with np.errstate(divide="ignore", over="ignore"):
        sigma = np.sqrt(unexplained / power / (averages - 1.0)) if averages >= 2.0 else np.full(gxx.shape, np.inf)
    if options.differenced:
        with np.errstate(divide="ignore", invalid="ignore"):
            step = divisor(frequency, sampling_rate)
            response, sigma = response / step, sigma / np.abs(step)
    least = max(options.min_coherence, options.repeated) if periodic else options.min_coherence
    trusted = excited & (coherence >= least) & np.isfinite(sigma) & (averages >= 2.0)
    kernel = np.ones(1) if periodic else _kernel(shape)
    half = (kernel.shape[0] - 1) // 2
    apart = np.ones(1) if periodic else spectra.quadratic / max(spectra.quadratic[0], np.finfo(float).tiny)
    apart = np.where(apart < 1e-6, 0.0, apart)
    return FrequencyResponse(
        frequency=frequency[inside],
        response=response[inside],
        coherence=coherence[inside],
        sigma=sigma[inside],
        trusted=trusted[inside],
        sampling_rate=sampling_rate,
        averages=averages,
        resolution=sampling_rate / shape.length,
        input_unit=options.units[0],
        output_unit=options.units[1],
        rate_error=options.rate_error,
        line_correlation=apart[: int(np.max(np.flatnonzero(apart), initial=-1)) + 1],
        kernel_offset=np.arange(-half, half + 1) * 0.5 * sampling_rate / shape.length,
        kernel_weight=kernel,
        kernel_amplitude=np.zeros(0) if periodic else _amplitude(shape),
        pairs=_pairs(spectra, shape),
        hop=shape.hop / shape.length,
        smoothing=1 if periodic else 2 * NOISE_SMOOTHING + 1,
        differenced=options.differenced,
    )


@lru_cache(maxsize=8)
def _amplitude(shape: WindowShape) -> FloatArray:
    """(j,) transform of the centred window at the kernel's half lines: the signed square root of the kernel."""
    kernel = _kernel(shape)
    half = (kernel.shape[0] - 1) // 2
    offset = np.arange(-half, half + 1)
    transform = np.fft.fft(shape.taper(), 2 * shape.length)[offset] * np.exp(0.5j * np.pi * offset)
    return np.asarray(np.sqrt(kernel) * np.sign(transform.real))


def _pairs(spectra: Spectra, shape: WindowShape) -> FloatArray:
    """(n,) fraction of the pairs of windows that are 0, 1, .. hops apart.

    Calculated from the sum of the noise's correlation. All distances up to the overlap are assumed to be equally
    frequent (true without gaps and with slow forgetting).
    """
    if spectra.weight <= 0:
        return np.ones(1)
    single, double = _unmixing(shape) @ (spectra.quadratic / spectra.weight**2)
    shares = np.full(error_correlation(shape).shape[0], 2.0 * max(float(double), 0.0))
    shares[0] = max(float(single), 0.0)
    return shares


@lru_cache(maxsize=8)
def _unmixing(shape: WindowShape) -> FloatArray:
    """(2, LINES_APART) least-squares map from sums of the errors' correlation to the fractions of window pairs 0 hops, and 1 or more hops, apart."""
    correlation = error_correlation(shape)
    return np.asarray(np.linalg.pinv(np.stack((correlation[0], 2.0 * np.sum(correlation[1:], axis=0)), axis=1)))


def _excited(gxx: FloatArray, inside: slice, reach: int) -> NDArray[np.bool_]:
    """Lines whose input power, and that of all neighbours within the window's main lobe, is not negligible."""
    own = gxx[inside]
    place = int(STRONG * (own.size - 1))
    strong = max(float(np.partition(own, place)[place]), float(own.mean())) if own.size else 0.0  # in a narrow band the mean is larger
    if reach == 0 and strong < float(own.max(initial=0.0)) * EXCITED:
        strong = float(own.max(initial=0.0))
    above = gxx > EXCITED * strong
    if strong <= 0.0:
        return np.zeros_like(above)
    result = above.copy()
    for shift in range(1, reach + 1):
        result[shift:] &= above[:-shift]
        result[:-shift] &= above[shift:]
    return result


@compiled
def smoothed(power: FloatArray, width: int) -> FloatArray:
    """(m,) mean over ``width`` lines (odd) around each; beyond the ends the first and last line are repeated."""
    half, last = width // 2, power.shape[0] - 1
    out = np.zeros(power.shape[0])
    for shift in range(-half, half + 1):
        for i in range(power.shape[0]):
            out[i] += power[min(max(i + shift, 0), last)]
    return out / width
