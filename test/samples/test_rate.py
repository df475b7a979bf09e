"""The sampling rate from all stamps so far: its value, its error, and its invariances."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.rate import BATCH, StampLine, error_of_rate
from xy_sysid.samples.recording import rate_from_time


def stamps(rate: float, count: int, jitter: float, seed: int = 0) -> FloatArray:
    """Stamps of samples read ``jitter`` periods (rms) early or late."""
    return np.asarray((np.arange(count) + jitter * np.random.default_rng(seed).standard_normal(count)) / rate)


def line(time: FloatArray, piece: int = 37) -> StampLine:
    found = StampLine()
    for start in range(0, len(time), piece):
        found.add(start, time[start : start + piece])
        found.until(min(start + piece, len(time)))
    return found


def test_the_rate_is_within_its_error_and_sharper_with_every_sample() -> None:
    """20 % of jitter at 503.7 Hz, 60 times: 95 % of the errors are within two standard errors, and the error falls as n^-3/2."""
    off = []
    for seed in range(60):
        found = line(stamps(503.7, 6000, 0.2, seed))
        assert found.rate is not None
        off.append((found.rate / 503.7 - 1.0) / found.error)
    assert np.mean(np.abs(off) < 2.0) > 0.85 and 0.7 < np.std(off) < 1.4
    errors = [line(stamps(503.7, count, 0.2)).error for count in (1000, 16_000)]
    assert errors[0] / errors[1] == pytest.approx(16.0**1.5, rel=0.5)


def test_jitter_that_hangs_together_counts() -> None:
    """A late cycle delays its neighbours: for assumed independent stamps the error would be several times too small."""
    random = np.random.default_rng(4)
    off = []
    for _ in range(40):
        late = np.convolve(random.standard_normal(20_200), np.exp(-np.arange(200) / 20.0), "valid")[:20_000]
        found = line((np.arange(20_000) + 0.1 * late) / 503.7)
        assert found.rate is not None
        off.append((found.rate / 503.7 - 1.0) / found.error)
    assert np.std(off) < 2.0


def test_pieces_change_nothing_to_the_last_bit() -> None:
    """Blocks of any size give the same numbers, live and replayed."""
    time = stamps(500.0, 5003, 0.2)
    one = StampLine()
    one.add(0, time)
    one.until(5003)
    other = line(time, 1)
    assert (one.rate, one.error) == (other.rate, other.error)


def test_losses_and_jumps_of_the_clock_do_no_harm() -> None:
    """A gap in the counter is on the line; after a jump of the clock a new line of the same rate begins, and both count."""
    time = stamps(503.7, 8000, 0.05)
    found = StampLine()
    found.add(0, time[:3000])
    found.add(3500, time[3500:])
    found.until(8000)
    assert found.rate == pytest.approx(503.7, rel=3 * found.error)
    before = found.error
    found.cut()
    found.add(8000, stamps(503.7, 8000, 0.05, 1) - 1e4)
    found.until(16_000)
    assert found.rate == pytest.approx(503.7, rel=3 * found.error) and found.error < before


@pytest.mark.parametrize("place", [3000, 3015, 3035, 3049])
def test_a_number_that_slips_begins_a_new_stretch(place: int) -> None:
    """One uncounted sample, anywhere in a batch: as part of the line it would change the slope by many standard errors."""
    time = stamps(503.7, 6000, 0.1)
    found = StampLine()
    found.add(0, np.delete(time, place))
    found.until(6000)
    assert found.rate == pytest.approx(503.7, rel=3 * found.error) and found.error < 2e-6


def test_few_stamps_tell_nothing_and_even_ones_all() -> None:
    """Without an error estimate there is no rate; without jitter the error is zero, and integers stay exact."""
    assert line(stamps(500.0, 4 * BATCH, 0.0)).rate is None
    even = line(stamps(2000.0, 4000, 0.0))
    assert even.rate == 2000.0 and even.error < 1e-12


def test_the_first_stamps_give_the_rate_by_a_straight_line() -> None:
    """200 stamps with 20 % of jitter: the error is several times smaller than from the first and the last alone."""
    seq = np.arange(200)
    off = [rate_from_time(stamps(500.0, 200, 0.1, seed), seq) / 500.0 - 1.0 for seed in range(200)]
    ends = [199.0 / (time[-1] - time[0]) / 500.0 - 1.0 for time in (stamps(500.0, 200, 0.1, seed) for seed in range(200))]
    assert np.std(off) < 0.4 * np.std(ends)


def test_a_recording_tells_how_sure_its_rate_is() -> None:
    """From its stamps; 0 for evenly spaced ones."""
    seq = np.arange(6000)
    assert error_of_rate(stamps(500.0, 6000, 0.2), seq) == pytest.approx(0.2 * np.sqrt(12.0) * 6000.0**-1.5, rel=0.5)
    assert error_of_rate(seq / 500.0, seq) < 1e-12
