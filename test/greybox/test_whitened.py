"""The baseline for one-step prediction: a simulation whose error is predicted from its past."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from xy_sysid.errors import BadInput
from xy_sysid.greybox.whitened import whitened_rms


def test_an_error_s_own_past_predicts_it_to_its_innovation() -> None:
    """Only the white part of a coloured error remains, on held-out parts spread over the record."""
    white = 1e-4 * np.random.default_rng(0).standard_normal(60_000)
    error = 2e-3 + lfilter([1.0], [1.0, -1.9, 0.95], white)
    held = (np.arange(error.size) // 5000) % 3 == 1
    assert whitened_rms(error, held) == pytest.approx(1e-4, rel=0.02)
    assert float(np.std(error)) > 5e-4
    swapped = error.copy()
    swapped[held] *= 100.0  # held-out samples have no influence on the fit
    assert whitened_rms(swapped, held) > 50.0 * 1e-4


def test_too_little_to_whiten_is_refused() -> None:
    """The error states the required amount."""
    with pytest.raises(BadInput, match="at least 240"):
        whitened_rms(np.zeros(200), np.arange(200) > 150)
    with pytest.raises(BadInput, match="one and the same"):
        whitened_rms(np.zeros(200), np.zeros(100, dtype=np.bool_))
