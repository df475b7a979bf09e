"""Window, period and band are chosen from the record."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from helpers.real_data import data
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.fitting.of_recording import estimate, few_periods
from xy_sysid.fitting.of_run import fit, frf
from xy_sysid.imports import load
from xy_sysid.response.period import find_half_period, find_period
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

RATE = 500.0
PLANT = signal.cont2discrete((np.array([1.0]), np.array([1.0, 20.0, 0.0])), 1 / RATE)


def answer(u: FloatArray) -> FloatArray:
    """The answer of a mass with friction to its input, with encoder noise."""
    y = signal.lfilter(PLANT[0].ravel(), PLANT[1], u)
    return np.asarray(y + 1e-7 * np.random.default_rng(5).standard_normal(u.size))


def noise(size: int, seed: int = 1) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize(("samples", "window"), [(20_000, 4096), (9_000, 2048), (1_500, 256), (400, 128)])
def test_the_window_fits_the_record(samples: int, window: int) -> None:
    """A short record has at least three shorter windows, with a note; a long one has the default windows."""
    u = noise(samples)
    found = estimate(Recording.from_arrays(RATE, u, answer(u)), "x", IdentifierSettings())
    assert found.frf.resolution == pytest.approx(RATE / window) and found.windows >= 3
    assert any(f"Windows of {window} samples" in note for note in found.notes) == (window != 4096)


def test_a_window_that_was_asked_for_stays() -> None:
    """Only the default length is changed."""
    u = noise(9_000)
    assert frf(Recording.from_arrays(RATE, u, answer(u)), length=1024).resolution == pytest.approx(RATE / 1024)


def test_many_short_stretches_are_used_together() -> None:
    """Forty stretches of 150 samples give at least forty windows, for any start, and most lines are trusted."""
    u = noise(40 * 150)
    whole = Recording.from_arrays(RATE, u, answer(u))
    apart = dataclasses.replace(whole, seq=whole.seq + 7 * (whole.seq // 150))
    found = estimate(apart, "x", IdentifierSettings())
    assert found.windows >= 40 and found.frf.trusted.mean() > 0.8


@pytest.mark.parametrize(("period", "times"), [(8192, 4), (512, 2), (511, 2), (511, 5)])
def test_the_period_is_found_from_two_of_them_on(period: int, times: int) -> None:
    """A period of any length is found; the first is left out if two remain, and the lines above the noise are trusted."""
    u = np.tile(noise(period), times)
    assert find_period(u) == period
    found = estimate(Recording.from_arrays(RATE, u, answer(u)), "x", IdentifierSettings(band_high=250.0))
    assert found.period == period and found.windows == times - (times > 2)
    assert found.frf.trusted[found.frf.frequency < 100.0].mean() > 0.9


def test_what_does_not_repeat_has_no_period() -> None:
    """Noise, a sweep, and one and a half periods."""
    once = noise(2048)
    sweep = signal.chirp(np.arange(8192) / RATE, 0.5, 8192 / RATE, 60.0)
    for u in (noise(8192), sweep, np.concatenate((once, once[:1024]))):
        assert find_period(u) is None and find_half_period(u) is None


def test_half_periods_of_the_other_sign_are_used() -> None:
    """A single period of an odd multisine: its two halves give the response and its uncertainty."""
    half, lines = 512, np.arange(1, 201, 2)
    t = np.arange(4 * half) / (2 * half)
    phases = np.random.default_rng(2).uniform(0, 2 * np.pi, lines.size)
    u = np.sum([np.cos(2 * np.pi * line * t + phase) for line, phase in zip(lines, phases, strict=True)], axis=0)
    y = answer(u)[2 * half :]
    recording = Recording.from_arrays(RATE, u[2 * half :], y)
    assert find_period(recording.voltage[:, 0]) is None and find_half_period(recording.voltage[:, 0]) == half
    found = estimate(recording, "x", IdentifierSettings(band_high=250.0))
    taken = found.frf.trusted
    assert np.rint(found.frf.frequency[taken] * 2 * half / RATE).astype(int).tolist() == lines[1:].tolist() or int(taken.sum()) >= 95
    s = np.exp(2j * np.pi * found.frf.frequency[taken] / RATE)
    truth = np.polyval(PLANT[0].ravel(), s) / np.polyval(PLANT[1], s)
    assert float(np.max(np.abs(found.frf.response[taken] / truth - 1))) < 0.02
    assert few_periods(recording, 0.2) and not few_periods(Recording.from_arrays(RATE, np.tile(noise(512), 10), noise(5120)), 0.2)


def test_the_band_follows_the_input() -> None:
    """A sweep that ends at 10 Hz has no information at 249 Hz: no line above its end is trusted or fitted."""
    t = np.arange(int(60 * RATE)) / RATE
    u = 3 * signal.chirp(t, 0.5, 60, 10) + 1e-3 * noise(t.size)
    y = np.round(answer(u) / 1e-6) * 1e-6
    response = frf(Recording.from_arrays(RATE, u, y), band_high=250.0)
    assert 9.0 < float(response.frequency[response.trusted].max()) < 11.0
    model = fit(response)
    assert model.fit is not None and float(model.fit.frequency[-1]) < 11.0


def test_white_noise_is_trusted_as_far_as_it_goes() -> None:
    """The same rule removes no lines for an input that excites all of them."""
    u = noise(60_000)
    response = frf(Recording.from_arrays(RATE, u, signal.lfilter(PLANT[0].ravel(), PLANT[1], u)), band_high=250.0)
    assert response.trusted.mean() > 0.98


def test_periods_of_measured_data_are_found() -> None:
    """A ground vibration test, 4 periods of 8,192 with modes at 7.4 Hz; a flexible arm, two halves of 512 with a mode at 63.35 Hz."""
    f16 = load(data("f16/f-16.txt"), columns={"input": "2", "output": "3"}, units={"input": "N", "output": "m/s^2"}, rate=400.0)
    found = estimate(f16, "x", IdentifierSettings())
    assert found.period == 8192 and 14.9 < float(found.frf.frequency[found.frf.trusted].max()) < 15.1
    arm = load(data("daisy/robot_arm.dat"), columns={"input": "1", "output": "2"}, units={"input": "N m", "output": "rad/s^2"}, rate=500.0)
    response = frf(arm)
    assert response.origin.notes and "other sign every 512" in " ".join(response.origin.notes)
    modes = [mode.frequency for mode in fit(response).tf.pole_modes()]
    assert any(mode == pytest.approx(63.35, abs=0.3) for mode in modes)


def test_friction_that_holds_the_output_in_every_window_is_no_broken_encoder() -> None:
    """An axis that sticks at each reversal is used with a note; one whose encoder fails after the first window is refused."""
    t = np.arange(6_000) / RATE
    u = np.sin(2 * np.pi * 2.0 * t) + 0.01 * noise(t.size)
    sticking = 1e-3 * np.cumsum(np.where(np.abs(u) > 0.7, u, 0.0))
    found = estimate(Recording.from_arrays(RATE, u, sticking), "x", IdentifierSettings(frozen=0.05))
    assert any("friction holds it" in note for note in found.notes) and found.windows >= 1
    dead = np.where(np.arange(t.size) < 100, sticking, sticking[100])
    with pytest.raises(BadInput, match="number of sound windows is 0"):
        estimate(Recording.from_arrays(RATE, u, dead), "x", IdentifierSettings(frozen=0.05))


def test_an_input_that_is_constant_in_every_stretch_is_no_excitation() -> None:
    """Twelve speeds in twelve stretches, resampled with rounding errors: refused, with the command for such tests; rounding is not fitted."""
    level = np.repeat(np.random.default_rng(2).uniform(-2.0, 2.0, 12), 400)
    u = level * (1.0 + 1e-12 * noise(level.size))
    whole = Recording.from_arrays(RATE, u, answer(level))
    apart = dataclasses.replace(whole, seq=whole.seq + 200 * (whole.seq // 400))
    with pytest.raises(BadInput, match=r"the input kept one value.*xy-sysid steps"):
        estimate(apart, "x", IdentifierSettings())


def test_a_counter_is_no_output() -> None:
    """A uniformly rising signal, such as a clock, has no response; the error names it, instead of lines at -600 dB."""
    u = noise(20_000)
    with pytest.raises(BadInput, match=r"rose evenly.*another output"):
        estimate(Recording.from_arrays(RATE, u, 0.2 * np.arange(u.size)), "x", IdentifierSettings())
