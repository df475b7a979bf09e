"""Several realisations of a periodic input distinguish noise from nonlinear distortion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import xy_sysid as xy
from xy_sysid.samples.recording import Recording

PERIOD, PERIODS, RATE, NOISE, BEND = 512, 6, 500.0, 2e-3, 0.3


def realisations(count: int, bend: float, noise: float = NOISE) -> Recording:
    """A filter behind a cubic law, with noise, driven by multisines of different phases, in sequence with gaps."""
    random, parts = np.random.default_rng(8), []
    for _ in range(count):
        phases = np.exp(2j * np.pi * random.uniform(size=PERIOD // 4))
        spectrum = np.zeros(PERIOD // 2 + 1, dtype=np.complex128)
        spectrum[1 : 1 + phases.size] = phases
        u = np.tile(np.fft.irfft(spectrum), PERIODS)
        u = u / u.std()
        y = signal.lfilter([0.2], [1.0, -0.8], u + bend * u**3 / 3)
        parts.append((u, y + noise * random.normal(size=y.size)))
    whole = Recording.from_arrays(RATE, np.concatenate([u for u, _ in parts]), np.concatenate([y for _, y in parts]))
    seq = np.concatenate([np.arange(PERIOD * PERIODS) + k * (PERIOD * PERIODS + 5) for k in range(count)])
    return replace(whole, seq=seq, time=seq / RATE)


def test_noise_and_distortion_are_told_apart() -> None:
    """The noise of the response, from the periods, is that of the sensor; the distortion is far above it, and sigma is the larger of the two."""
    found = xy.frf(realisations(8, BEND), band_high=100.0, differenced=False)
    lines = found.select(found.trusted)
    assert len(lines) > 80
    driven = np.sqrt(PERIOD / 2 / (PERIOD // 4)) * np.sqrt(PERIOD / 2)  # |U| of a line
    assert float(np.median(lines.noise)) == pytest.approx(NOISE * np.sqrt(PERIOD) / driven / np.sqrt(2) / np.sqrt(PERIODS - 1), rel=0.3)
    assert float(np.median(lines.distortion / lines.noise)) > 10.0
    np.testing.assert_allclose(lines.sigma, np.hypot(lines.noise, lines.distortion) / np.sqrt(8), rtol=0.05)
    assert any("realisations" in note for note in found.origin.notes)


def test_a_linear_machine_shows_no_distortion() -> None:
    """The differences between realisations are then noise only."""
    found = xy.frf(realisations(8, 0.0), band_high=100.0, differenced=False)
    lines = found.select(found.trusted)
    assert float(np.sqrt(np.mean(lines.distortion**2) / np.mean(lines.noise**2))) < 1.0


def test_both_are_drawn_in_the_bode_plot() -> None:
    """A dotted line for the noise and a dashed one for the distortion."""
    figure = xy.plot.bode(xy.frf(realisations(4, BEND), band_high=100.0))
    names = {trace.name for trace in figure.data}
    assert any(name.startswith("noise") for name in names) and any(name.startswith("nonlinear distortion") for name in names)
