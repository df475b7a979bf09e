"""Best linear approximation from several realisations of a periodic input, with separate noise and nonlinear distortion.

Within a realisation only noise differs from period to period. From one realisation (other random phases) to the next, the distortion by friction
and other nonlinear laws differs too: it looks like noise, but averaging over periods does not reduce it. So the scatter over periods gives the noise,
and the scatter over realisations gives noise plus distortion. (Pintelon & Schoukens, System Identification, 2nd ed., sec. 4.3.1, the robust method;
Schoukens, Vaes & Pintelon, IEEE Control Syst. Mag. 36 (2016), 38-69)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import divisor
from xy_sysid.samples.block import FloatArray

DRIVEN = 1e-3  # of the strongest line's power; a weaker line is not excited
FEWEST = 2  # realisations, and periods of each

Realisation = tuple[FloatArray, FloatArray]
"""Input (periods, length) and output (periods, length), the output differenced if the response is."""


def best_linear(frf: FrequencyResponse, realisations: Sequence[Realisation]) -> FrequencyResponse:
    """The response averaged over realisations, with its scatter over realisations and periods; unchanged if there are too few of either.

    frf: of the same windows, one period each. ``sigma`` becomes the larger of the values from noise and from noise plus distortion; ``noise`` and
    ``distortion`` are the standard deviations of one realisation's response.
    """
    used = [(u, y) for u, y in realisations if u.shape[0] >= FEWEST]
    if len(used) < FEWEST:
        return frf
    each = [np.fft.rfft(signals, axis=2) for signals in (np.stack([u, y]) for u, y in used)]
    lines = np.rint(frf.frequency / frf.resolution).astype(np.int64)
    inputs = np.array([one[0].mean(axis=0)[lines] for one in each])
    driven = np.all(np.abs(inputs) ** 2 > DRIVEN * np.max(np.abs(inputs) ** 2, axis=1, keepdims=True), axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        responses = np.array([one[1].mean(axis=0)[lines] / one[0].mean(axis=0)[lines] for one in each])
        noise = np.array([_noise(one[:, :, lines]) for one in each])
    count = len(used)
    mean = responses.mean(axis=0)
    total = np.sum(np.abs(responses - mean) ** 2, axis=0) / (count - 1)
    own = noise.mean(axis=0)
    step = np.abs(divisor(frf.frequency, frf.sampling_rate)) if frf.differenced else np.ones(len(frf))
    sigma = np.sqrt(np.maximum(total, own) / count) / step
    response: ComplexArray = mean / divisor(frf.frequency, frf.sampling_rate) if frf.differenced else mean
    return replace(
        frf,
        response=np.where(driven, response, frf.response),
        sigma=np.where(driven, sigma, np.inf),
        trusted=frf.trusted & driven & (sigma > 0.0),
        averages=float(count),
        noise=np.where(driven, np.sqrt(own) / step, np.nan),
        distortion=np.where(driven, np.sqrt(np.maximum(total - own, 0.0)) / step, np.nan),
    )


def _noise(spectra: ComplexArray) -> FloatArray:
    """(lines,) variance of one realisation's response from its scatter over periods; spectra: (2, periods, lines) of input and output."""
    u, y = spectra
    left = y - u * (y.mean(axis=0) / u.mean(axis=0))
    power = np.sum(np.abs(left - left.mean(axis=0)) ** 2, axis=0) / (u.shape[0] - 1)
    return np.asarray(power / u.shape[0] / np.abs(u.mean(axis=0)) ** 2)
