"""Correlations of a residual: none for unrelated signals, and significant ones for an input that a model misses."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from xy_sysid.comparison.residual_correlation import residual_correlation
from xy_sysid.errors import BadInput

N = 40_000


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=N)


def test_a_white_residual_stays_within_its_bounds() -> None:
    """One lag in twenty is outside by chance, over thirty draws."""
    outside, own = [], []
    for seed in range(30):
        found = residual_correlation(noise(seed), noise(1000 + seed))
        outside.append(found.outside)
        own.append(float(np.mean(np.abs(found.autocorrelation[1:]) > found.white)))
    assert 0.03 < float(np.mean(outside)) < 0.07
    assert 0.03 < float(np.mean(own)) < 0.07


def test_coloured_but_unrelated_signals_stay_within_their_bounds() -> None:
    """An encoder's alternating noise and a filtered input are no fault of the model; bounds of white noise would be too narrow."""
    outside = []
    for seed in range(30):
        residual = scipy.signal.lfilter([1.0], [1.0, -0.9], noise(seed))
        voltage = scipy.signal.lfilter([1.0], [1.0, -0.9], noise(1000 + seed))
        found = residual_correlation(residual, voltage)
        assert found.unrelated > 2.0 * found.white
        outside.append(found.outside)
    assert 0.02 < float(np.mean(outside)) < 0.08


def test_what_the_model_misses_stands_out_at_its_delay() -> None:
    """A hundredth of the input, seven samples late, below noise: found at seven, and at no other shift."""
    voltage = noise(1)
    found = residual_correlation(0.1 * np.roll(voltage, 7) + noise(2), voltage)
    assert found.shift[int(np.argmax(np.abs(found.cross)))] == 7
    assert found.cross.max() == pytest.approx(0.1, abs=0.02)
    assert float(np.mean(np.abs(np.delete(found.cross, int(np.argmax(found.cross)))) > found.unrelated)) < 0.12


def test_the_autocorrelation_is_that_of_the_process() -> None:
    """Differences of white noise, as of an encoder: -0.5 at one sample, 0 beyond."""
    found = residual_correlation(np.diff(noise(3), prepend=0.0), noise(4))
    assert found.autocorrelation[0] == 1.0
    assert found.autocorrelation[1] == pytest.approx(-0.5, abs=0.02)
    assert np.abs(found.autocorrelation[2:]).max() < 0.03


@pytest.mark.parametrize(
    ("residual", "voltage", "words"),
    [
        (np.ones(3000), np.ones(2000), "3000 samples"),
        (np.arange(500.0), np.arange(500.0), "at least 2000 for 100 lags"),
        (np.zeros(3000), np.arange(3000.0), "does not move"),
    ],
)
def test_what_cannot_be_told_is_refused_with_the_reason(residual: np.ndarray, voltage: np.ndarray, words: str) -> None:
    """Lengths, too few samples, a constant signal."""
    with pytest.raises(BadInput, match=words):
        residual_correlation(residual, voltage)
