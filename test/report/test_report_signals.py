"""The reduced points of figures of long signals keep all extremes."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.excitation.noise import noise
from xy_sysid.report.signals import density, envelope, excitation, motion
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation


def test_an_envelope_keeps_the_extremes_of_every_part() -> None:
    """Single spikes survive the decimation of a million samples, at their times."""
    random = np.random.default_rng(1)
    time = np.arange(1_000_000) / 2000.0
    value = random.normal(size=time.size)
    value[123_456], value[777_777] = 50.0, -60.0
    t, v = envelope(time, value, 500)
    assert t.size == v.size == 1000
    assert v.max() == 50.0 and t[np.argmax(v)] == time[123_456]
    assert v.min() == -60.0 and t[np.argmin(v)] == time[777_777]
    assert bool(np.all(np.diff(t) >= 0))
    parts = value.reshape(500, 2000)
    np.testing.assert_array_equal(np.sort(v.reshape(500, 2), axis=1), np.stack((parts.min(axis=1), parts.max(axis=1)), axis=1))


def test_a_short_signal_is_drawn_as_it_is() -> None:
    """No decimation of short signals."""
    time, value = np.arange(10.0), np.arange(10.0) ** 2
    t, v = envelope(time, value, 5)
    np.testing.assert_array_equal(t, time)
    np.testing.assert_array_equal(v, value)


def test_drift_is_the_slope_of_the_whole_and_a_gap_is_not_drawn_over() -> None:
    """1 mm/s of drift is found, and missing samples are NaN."""
    seq = np.concatenate((np.arange(4000), np.arange(6000, 10_000)))
    time = seq / 1000.0
    y = (1e-3 * time + 2e-3 + 1e-4 * np.sin(40 * time))[:, None]
    found = motion(Recording(1000.0, ("x",), seq, time, np.ones_like(y), y), "x", 100)
    assert found.drift == pytest.approx(1e-3, rel=0.02)
    gaps = np.flatnonzero(np.isnan(found.value))
    assert gaps.size == 2 and 3.9 < found.time[gaps[0]] < 4.1
    assert (found.low, found.high) == (float(y.min()), float(y.max()))


def test_the_band_edges_of_noise_are_found_and_the_power_is_kept() -> None:
    """White noise filtered to 300 Hz: the edge is found, and the integral of the density is the variance."""
    u = noise(AxisExcitation(low=1.0, high=300.0, rms=2.0), 2000.0).next(120_000)
    found = density(u, 2000.0)
    assert found.low == pytest.approx(1.0, rel=0.15)
    assert found.high == pytest.approx(300.0, rel=0.05)
    inside = (found.frequency > 10) & (found.frequency < 250)
    assert float(np.median(found.density[inside])) == pytest.approx(4.0 / 299.0, rel=0.05)


def test_the_distribution_adds_up_to_one_and_ends_at_zero() -> None:
    """A density: its integral is 1, and its ends show."""
    u = np.random.default_rng(2).normal(0.0, 0.7, (20_000, 1))
    seq = np.arange(20_000)
    found = excitation(Recording(2000.0, ("x",), seq, seq / 2000.0, u, u), "x")
    assert float(np.sum(found.share) * (found.centre[1] - found.centre[0])) == pytest.approx(1.0, rel=1e-9)
    assert found.share[0] == found.share[-1] == 0.0
    assert found.rms == pytest.approx(0.7, rel=0.02)
    assert found.time.size == 500
