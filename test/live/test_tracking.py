"""The watch on a resonance."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.live.resonance_watch import CONFIRM, Resonance, Track, alarm_sentence, follow


def run(frequencies: list[float], error: float = 0.05) -> list[Track]:
    track, tracks = Track(), []
    for k, frequency in enumerate(frequencies):
        windows = 2 * k + 5
        track = follow(track, Resonance(47.0, error / 3), Resonance(frequency, error), windows, 4.0)
        tracks.append(track)
    return tracks


def test_a_moved_resonance_raises_the_alarm_after_confirmation() -> None:
    """One deviating fit may be chance, the second is not."""
    tracks = run([47.0] * 20 + [46.0] * 3)
    assert not any(t.alarm for t in tracks[: 20 + CONFIRM - 1])
    assert tracks[20 + CONFIRM - 1].alarm
    assert tracks[-1].shift == pytest.approx(-1.0)
    assert "moved down by 1.00 Hz, from 47.00 to 46.00" in alarm_sentence("x", tracks[-1])


def test_scatter_within_the_interval_raises_no_alarm() -> None:
    """A thousand fits of an unchanged resonance: no alarm at four standard errors with confirmation."""
    scatter = np.random.default_rng(0).normal(47.0, 0.05, 1000)
    assert not any(t.alarm for t in run(scatter.tolist()))


def test_the_alarm_ends_when_the_resonance_is_back() -> None:
    """Bolts tightened again: back to normal."""
    tracks = run([47.0] * 20 + [46.0] * 4 + [47.0])
    assert tracks[-2].alarm
    assert not tracks[-1].alarm


def test_the_reference_does_not_follow_a_slow_drift() -> None:
    """The reference is the first state of the machine, so that slow drift is detected."""
    tracks = run([47.0] * 40 + np.linspace(47.0, 45.5, 60).tolist())
    assert tracks[-1].alarm
    assert tracks[-1].reference is not None
    assert tracks[-1].reference.frequency == 47.0


def test_without_a_resonance_nothing_is_tracked() -> None:
    """A rigid machine has none, and no alarm."""
    track = follow(Track(), None, None, 100, 4.0)
    assert track == Track()
    assert np.isnan(track.shift)
