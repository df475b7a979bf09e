"""Responses of exactly known machines, for tests of fits."""

from __future__ import annotations

import numpy as np

from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

RATE = 2000.0


def paper_machine(delay: float = 1.29e-3) -> TransferFunction:
    """Velocity gain 0.097 m/s/V, pole 246 rad/s, antiresonance 46.2 Hz, resonance 47.56 Hz."""
    zero, pair = 2 * np.pi * 46.2, 2 * np.pi * 47.56
    numerator = 0.097 * 246.0 * (pair / zero) ** 2 * np.array([1.0, 2 * 0.015 * zero, zero**2])
    denominator = np.convolve([1.0, 246.0, 0.0], [1.0, 2 * 0.04 * pair, pair**2])
    return TransferFunction(numerator, denominator, delay)


def lines(count: int = 613, spacing: float = RATE / 4096) -> FloatArray:
    """Hz, from the first line on."""
    return spacing * np.arange(1.0, count + 1.0)


def measured(frequency: FloatArray, response: ComplexArray, sigma: float = 1e-6, rate: float = RATE) -> FrequencyResponse:
    """A response without window: sigma is a share of its magnitude."""
    return FrequencyResponse(
        frequency=frequency,
        response=response,
        coherence=np.full(frequency.size, 1.0 - sigma**2),
        sigma=sigma * np.abs(response),
        trusted=np.ones(frequency.size, dtype=bool),
        sampling_rate=rate,
        averages=100.0,
        resolution=float(frequency[1] - frequency[0]),
    )


def held(tf: TransferFunction, frequency: FloatArray | None = None, sigma: float = 1e-6) -> FrequencyResponse:
    """Response from held samples to samples, without noise."""
    frequency = lines() if frequency is None else frequency
    return measured(frequency, held_response(tf, frequency, RATE), sigma)
