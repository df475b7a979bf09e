"""Known machines and their responses, for the tests of fitting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.signal

from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
RESOLUTION = RATE / 4096
LINES: FloatArray = np.asarray(np.arange(1, 613) * RESOLUTION, dtype=np.float64)
DENSE: FloatArray = np.asarray(np.linspace(0.5, 999.0, 301), dtype=np.float64)


def function(numerator: object, denominator: object, delay: float = 0.0) -> TransferFunction:
    """A transfer function from sequences of coefficients of falling powers."""
    return TransferFunction(np.atleast_1d(np.asarray(numerator, dtype=np.float64)), np.atleast_1d(np.asarray(denominator, dtype=np.float64)), delay)


def paper_machine(delay: float = 1.29e-3) -> TransferFunction:
    """0.097 m/s/V, pole 246 rad/s, base antiresonance and resonance at 45 and 47 Hz."""
    zero, pole = 2 * np.pi * 45.0, 2 * np.pi * 47.0
    numerator = 0.097 * 246.0 * (pole / zero) ** 2 * np.array([1.0, 2 * 0.03 * zero, zero**2])
    return function(numerator, np.polymul([1.0, 246.0, 0.0], [1.0, 2 * 0.02 * pole, pole**2]), delay)


def response_of(true: ComplexArray, relative_noise: float = 0.0, seed: int = 0, frequency: FloatArray = LINES) -> FrequencyResponse:
    """A measured response: independent errors with a known fraction of the truth, |error|^2 of sigma^2 on average."""
    rng = np.random.default_rng(seed)
    size = true.size
    sigma = np.abs(true) * relative_noise
    error = sigma * (rng.normal(size=size) + 1j * rng.normal(size=size)) / np.sqrt(2.0)
    return FrequencyResponse(
        frequency, true + error, np.ones(size), sigma, np.ones(size, dtype=np.bool_), RATE, averages=1000.0, resolution=RESOLUTION
    )


def held(tf: TransferFunction, relative_noise: float = 0.0, seed: int = 0) -> FrequencyResponse:
    """Response of a sampled machine with a hold, without a window's smoothing."""
    return response_of(held_response(tf, LINES, RATE), relative_noise, seed)


def blurred(tf: TransferFunction, offsets: FloatArray, weights: FloatArray) -> FrequencyResponse:
    """Response through a window of the differenced output: times (exp(jwT) - 1), smoothed, divided again."""
    total = np.zeros(LINES.size, dtype=np.complex128)
    for offset, weight in zip(offsets, weights, strict=True):
        at = LINES + offset
        nudged = np.where(np.abs(at) < 1e-9, 1e-6, at)  # at 0 Hz the product has a limit
        total += weight * held_response(tf, nudged, RATE) * np.expm1(2j * np.pi * nudged / RATE)
    seen = response_of(total / np.expm1(2j * np.pi * LINES / RATE))
    return replace(seen, kernel_offset=offsets, kernel_weight=weights, differenced=True)


def state_space_response(tf: TransferFunction, frequency: FloatArray) -> ComplexArray:
    """Response with hold, delay and sampler by matrix exponentials: an independent method."""
    period = 1.0 / RATE
    a, b, c, d = scipy.signal.tf2ss(tf.numerator, tf.denominator)
    order = a.shape[0]
    whole = int(np.ceil(tf.delay / period - 1e-12)) - 1
    part = tf.delay - whole * period

    def hold(time: float) -> tuple[FloatArray, FloatArray]:
        block = np.zeros((order + 1, order + 1))
        block[:order, :order], block[:order, order:] = a, b
        grown = scipy.linalg.expm(block * time)
        return grown[:order, :order], grown[:order, order:]

    step, (rest, new), (_, old) = hold(period)[0], hold(period - part), hold(part)
    out = np.empty(frequency.size, dtype=np.complex128)
    for i, z in enumerate(np.exp(2j * np.pi * frequency * period)):
        driven = rest @ old * z ** (-whole - 1) + new * z**-whole
        out[i] = (c @ np.linalg.solve(z * np.eye(order) - step, driven))[0, 0] + d[0, 0] * z ** (-whole - 1)
    return out
