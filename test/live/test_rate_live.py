"""Stamps with jitter: the rate is estimated from all of them, and its uncertainty is in the interval of every frequency."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from xy_sysid.linear.simulate import simulate
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.fitter import Update
from xy_sysid.live.identifier import Identifier
from xy_sysid.live.replay import replay
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.pairing import Quantity
from xy_sysid.settings import IdentifierSettings, build

RATE, PERIOD, TRUTH = 500.0, 1.0 / 500.0, 60.0  # Hz, s, Hz of the antiresonance
SETTINGS = build(IdentifierSettings, {"length": 512, "band_high": 200.0, "numerator_order": 2, "denominator_order": 4, "refit": 4.0})


def machine() -> TransferFunction:
    """An axis with an antiresonance at 60 Hz and a resonance at 75 Hz."""
    zero, pole = (np.array([1.0, 2 * 0.02 * 2 * np.pi * f, (2 * np.pi * f) ** 2]) for f in (TRUTH, 75.0))
    return TransferFunction(0.1 * 250.0 * zero * (pole[-1] / zero[-1]), np.polymul(np.polymul([1.0, 250.0, 0.0], [1.0]), pole), 1.3e-3)


def moved(seconds: float, seed: int) -> tuple[FloatArray, FloatArray]:
    random = np.random.default_rng(seed)
    u = random.standard_normal(round(seconds * RATE))
    y = simulate(machine(), RATE, u)
    return u, y + 2e-8 * random.standard_normal(y.size)


def heard(u: FloatArray, y: FloatArray, time: FloatArray, rows: int = 20) -> Iterator[tuple[Quantity, Block]]:
    for first in range(0, len(u), rows):
        seq = np.arange(first, min(first + rows, len(u)), dtype=np.float64)
        part = slice(first, first + rows)
        yield "voltage", Block(("x",), seq, seq / RATE, u[part, None])
        yield "position", Block(("x",), seq, time[part], y[part, None])


def last(u: FloatArray, y: FloatArray, time: FloatArray, rows: int = 20) -> Update:
    return list(replay(heard(u, y, time, rows), SETTINGS, ("x",)))[-1]


def jittered(count: int, seed: int) -> FloatArray:
    """Stamps with jitter of a fifth of a period, rms."""
    return np.asarray((np.arange(count) + 0.2 * np.random.default_rng(seed).standard_normal(count)) / RATE)


@pytest.mark.parametrize("seed", range(6))
def test_an_antiresonance_at_60_hz_is_found_there_with_20_per_cent_of_jitter(seed: int) -> None:
    """From the first 200 stamps alone the result was 59.92 +-0.003 Hz: now the truth is within the interval, which includes the rate's error."""
    u, y = moved(20.0, seed)
    update = last(u, y, jittered(len(u), 100 + seed))
    fit = update.axes["x"].fit
    assert fit is not None and fit.converged
    found = fit.interval("antiresonance_1.frequency")
    assert abs(update.request.sampling_rate / RATE - 1.0) < 2e-5
    assert abs(found.value - TRUTH) < 3 * found.sigma and found.sigma < 0.02


def test_what_the_rate_may_be_off_by_stands_in_every_interval_that_goes_with_it() -> None:
    """After 6 s of jitter the rate has an error of 5e-6 or more, which is in the intervals of frequencies and delay, but not of damping."""
    u, y = moved(6.0, 3)
    exact, late = (last(u, y, time) for time in (np.arange(len(u)) / RATE, jittered(len(u), 9)))
    sure, unsure = exact.axes["x"], late.axes["x"]
    assert sure.fit is not None and unsure.fit is not None
    error = unsure.frf.rate_error
    assert sure.frf.rate_error < 1e-12 and 2e-6 < error < 5e-5
    for name in ("antiresonance_1.frequency", "resonance_1.frequency", "delay", "gain"):
        before, now = sure.fit.interval(name), unsure.fit.interval(name)
        assert now.sigma == pytest.approx(np.hypot(before.sigma, error * before.value), rel=1e-3)
        assert now.sigma > before.sigma
    damping = "antiresonance_1.damping"
    assert unsure.fit.interval(damping).sigma == pytest.approx(sure.fit.interval(damping).sigma, rel=1e-3)


def test_the_rate_is_the_same_to_the_last_bit_however_the_samples_come() -> None:
    """Live and replayed, with blocks of any size, and one stream ahead of the other."""
    u, y = moved(8.0, 1)
    time = jittered(len(u), 2)
    reference = last(u, y, time)
    for rows in (1, 7, 333):
        other = last(u, y, time, rows)
        assert other.request.sampling_rate == reference.request.sampling_rate
        assert np.array_equal(other.axes["x"].frf.frequency, reference.axes["x"].frf.frequency)


def test_what_is_known_of_the_rate_outlives_a_restart() -> None:
    """The rate is saved with the spectra and restored, instead of starting from the next 200 stamps."""
    u, y = moved(20.0, 5)
    time = jittered(len(u), 6)
    first = Identifier(SETTINGS, ("x",))
    for kind, block in heard(u[:8000], y[:8000], time[:8000]):
        first.feed(kind, block)
    second = Identifier(SETTINGS, ("x",))
    second.restore(first.state())
    for kind, block in heard(u[8000:8600], y[8000:8600], time[8000:8600]):
        second.feed(kind, replace(block, seq=block.seq + 8000))
    assert first.sampling_rate is not None and second.sampling_rate is not None
    assert second.sampling_rate == pytest.approx(first.sampling_rate, rel=1e-6)
