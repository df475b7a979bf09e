"""Full recordings: gaps, periods, closed loop, friction and faults, and the notes about them."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from helpers.cli_tools import rigid, with_one
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.fitting.of_recording import estimate, judged, split
from xy_sysid.response.friction_hint import friction_hint, friction_note
from xy_sysid.response.period import find_period, period_note
from xy_sysid.response.window_check import window_fault
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

RATE = 1000.0
SETTINGS = IdentifierSettings(length=1024)


def recording(u: FloatArray, y: FloatArray, rate: float = RATE) -> Recording:
    """One axis, no gap."""
    count = np.arange(u.size)
    return Recording(rate, ("x",), count, count / rate, u[:, None], y[:, None])


def a_rigid(rows: int = 30_000) -> Recording:
    """A rigid axis under noise."""
    data = rigid(rows)
    return recording(data["u"], data["y"])


def multisine(period: float, rows: int, lines: int = 40, seed: int = 1) -> FloatArray:
    """Random phases on the first lines of a period in samples, which need not be whole."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines)
    count = np.arange(rows)
    return np.asarray(sum(np.cos(2 * np.pi * (k + 1) * count / period + phase) for k, phase in enumerate(phases)) / np.sqrt(lines))


def plant(u: FloatArray, seed: int = 1, noise: float = 1e-7) -> FloatArray:
    """The rigid axis of ``cli_tools`` for any input."""
    decay = np.exp(-0.1)
    y = signal.lfilter(1e-5 * np.array([0.0, 0.1 - 1 + decay, 1 - decay - 0.1 * decay]), np.array([1.0, -1 - decay, decay]), u)
    return np.asarray(y + noise * np.random.default_rng(seed).normal(size=u.size))


def error_in_sigma(found_frequency: FloatArray, response: object, sigma: FloatArray) -> float:
    """rms distance from the rigid axis' exact held response, in sigma."""
    z = np.exp(2j * np.pi * found_frequency / RATE)
    decay = np.exp(-0.1)
    true = 1e-5 * ((0.1 - 1 + decay) * z + 1 - decay - 0.1 * decay) / (z**2 - (1 + decay) * z + decay)
    return float(np.sqrt(np.mean(np.abs(np.asarray(response) - true) ** 2 / sigma**2)))


def test_a_gap_costs_only_its_windows() -> None:
    """Three seconds lost in the middle: fewer windows, the same response within its sigma."""
    whole = a_rigid()
    keep = np.r_[0:12_000, 15_000:30_000]
    holed = replace(whole, seq=whole.seq[keep], time=whole.time[keep], voltage=whole.voltage[keep], position=whole.position[keep])
    one, two = estimate(whole, "x", SETTINGS), estimate(holed, "x", SETTINGS)
    assert 0 < one.windows - two.windows <= 8
    lines = two.frf.select(two.frf.trusted)
    assert error_in_sigma(lines.frequency, lines.response, lines.sigma) < 1.3


def test_a_recording_of_gaps_only_is_refused() -> None:
    """No stretch is long enough: the error names the longest one, and the setting to change."""
    whole = a_rigid()
    seq = whole.seq + whole.seq // 500
    with pytest.raises(BadInput, match=r"longest gap-free run is 500 samples; allowed: 1025 or more.*--set length=125"):
        estimate(replace(whole, seq=seq), "x", SETTINGS)


def test_a_periodic_input_is_found_and_leaves_no_leakage() -> None:
    """Windows of one period, the first left out; only excited lines are trusted; sigma is that of the noise."""
    u = multisine(1000, 12_000)
    found = estimate(recording(u, plant(u)), "x", SETTINGS)
    assert found.period == 1000 and found.windows == 11
    assert "repeats every 1000 samples (1 s)" in found.notes[0] and "first one left out" in found.notes[0]
    assert int(found.frf.trusted.sum()) == 40
    lines = found.frf.select(found.frf.trusted)
    assert error_in_sigma(lines.frequency, lines.response, lines.sigma) < 1.5


def test_a_period_that_is_not_whole_is_not_taken_for_one() -> None:
    """Half a sample off in each period: windows would slip, so the tapered ones are used."""
    assert find_period(multisine(1000.5, 12_000)) is None and find_period(multisine(209.44, 12_000, lines=1)) is None
    assert find_period(multisine(1000, 12_000)) == 1000
    u = multisine(1000.5, 30_000)
    lines = estimate(recording(u, plant(u)), "x", replace_length(2048)).frf
    assert lines.resolution == RATE / 2048


def replace_length(length: int) -> IdentifierSettings:
    """Settings with this window."""
    return IdentifierSettings(length=length)


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_period_is_found_through_measurement_noise(noise: float) -> None:
    """A measured periodic input repeats except for a little noise; noise, a step or a ramp do not repeat."""
    random = np.random.default_rng(3)
    u: FloatArray = np.asarray(multisine(777, 9000) + noise * random.normal(size=9000), dtype=np.float64)
    assert find_period(u) == 777
    assert find_period(random.normal(size=9000)) is None
    assert find_period(np.where(np.arange(9000) > 4000, 1.0, 0.0)) is None
    assert find_period(np.arange(9000.0)) is None
    assert find_period(np.zeros(9000)) is None


def test_a_given_period_is_checked() -> None:
    """Longer than the data: an error; not that of the input: a note; the right one: no note."""
    u = multisine(1000, 12_000)
    assert period_note(u, 1000) == []
    assert "does not repeat after 900 samples" in period_note(u, 900)[0]
    with pytest.raises(BadInput, match="the longest gap-free run"):
        period_note(u, 12_001)
    assert estimate(recording(u, plant(u)), "x", SETTINGS, period=1000).period == 1000
    assert estimate(recording(u, plant(u)), "x", SETTINGS, period=None).period is None


def test_a_closed_loop_is_named() -> None:
    """An input that follows the tracking error biases H1; a reference unrelated to the input has no influence."""
    data, random = rigid(30_000), np.random.default_rng(5)
    reference = np.cumsum(random.normal(size=30_000)) * 1e-4
    position, loop = np.zeros(30_000), np.zeros(30_000)
    decay, past = np.exp(-0.1), np.zeros(2)
    for n in range(2, 30_000):
        position[n] = (1 + decay) * position[n - 1] - decay * position[n - 2] + 1e-5 * ((0.1 - 1 + decay) * loop[n - 1] + past[0])
        loop[n] = 2e4 * (reference[n] - position[n]) * 0.1
        past[0] = (1 - decay - 0.1 * decay) * loop[n - 1]
    closed = replace(recording(loop, position), reference=reference[:, None])
    assert any(note.startswith("Closed loop") for note in estimate(closed, "x", SETTINGS).notes)
    opened = replace(recording(data["u"], data["y"]), reference=reference[:, None])
    assert not any("loop" in note for note in estimate(opened, "x", SETTINGS).notes)


def test_friction_is_hinted_at_and_a_linear_machine_is_not_blamed() -> None:
    """0.3 V against the motion is found within its interval; an axis without it gives no note."""
    rows = 60_000
    drive = signal.lfilter(*signal.butter(2, 2.0, fs=RATE), np.random.default_rng(2).normal(size=rows)) * 40
    speed = np.zeros(rows)
    for n in range(1, rows):
        push = drive[n - 1] - 0.3 * np.sign(speed[n - 1]) if speed[n - 1] else drive[n - 1] - np.clip(drive[n - 1], -0.3, 0.3)
        following = np.exp(-0.05) * speed[n - 1] + 1e-3 * (1 - np.exp(-0.05)) * push
        speed[n] = 0.0 if following * speed[n - 1] < 0 else following
    sticky = np.cumsum(speed) / RATE
    hint = friction_hint(drive, sticky, RATE)
    assert hint is not None and hint.level == pytest.approx(0.3, abs=0.015) and hint.share > 0
    wired_the_other_way = friction_hint(-drive, sticky, RATE)
    assert wired_the_other_way is not None and wired_the_other_way.level == pytest.approx(hint.level)
    note = friction_note(hint)
    assert note.startswith("Friction: part of the input") and not any(letter.isdigit() for letter in note)
    smooth = rigid(rows)
    assert friction_note(friction_hint(smooth["u"], smooth["y"], RATE)) == ""
    assert friction_note(None) == "" and friction_hint(np.zeros(100), np.zeros(100), RATE) is None


def test_an_axis_that_never_turns_shows_no_friction() -> None:
    """For motion at constant speed in one direction, friction equals a load: it is not computed, so there is no warning of numpy."""
    drive = (np.arange(5_000) % 256 - 128).astype(np.float64)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert friction_hint(drive, np.arange(0.0, 1_000.0, 0.2), 5_000.0) is None


def test_windows_with_a_frozen_or_leaping_encoder_are_left_out() -> None:
    """Counted in a note; a recording without other samples is refused with the reason."""
    data = rigid(30_000)
    frozen = estimate(recording(data["u"], with_one(data["y"], slice(9000, 9500), 0.0)), "x", SETTINGS)
    assert "left out: in" in frozen.notes[0] and "repeated one value" in frozen.notes[0]
    lines = frozen.frf.select(frozen.frf.trusted)
    assert error_in_sigma(lines.frequency, lines.response, lines.sigma) < 1.3
    stuck = np.repeat(np.arange(60.0), 500)
    with pytest.raises(BadInput, match=r"number of sound windows is 0 of .*--set frozen="):
        estimate(recording(data["u"], stuck), "x", SETTINGS)


def test_a_standstill_before_a_step_is_no_fault() -> None:
    """Frozen means that the voltage changes and the encoder does not, for that long."""
    count: FloatArray = np.arange(2000, dtype=np.float64)
    step: FloatArray = np.where(count > 1000, 1.0, 0.0)
    assert window_fault(step, np.maximum(count - 1005.0, 0), 250) is None
    assert window_fault(step, np.maximum(count - 1400.0, 0), 250) == "frozen"
    assert window_fault(step, np.zeros(2000), 250) == "frozen"
    noise = np.random.default_rng(1).normal(size=2000)
    assert window_fault(noise, with_one(np.cumsum(noise), slice(500, 749), 0.0), 250) is None
    assert window_fault(noise, with_one(np.cumsum(noise), slice(500, 750), 0.0), 250) == "frozen"


def test_what_cannot_be_estimated_is_refused_before_any_work() -> None:
    """At rest, overflow, outside the band, an unknown axis."""
    data = rigid(5000)
    still, huge = np.zeros(5000), 1e200 * data["u"]
    for u, y, words in (
        (still, data["y"], "input of axis x is constant at 0 V"),
        (data["u"], still, "output of axis x is constant at 0 m"),
        (huge, data["y"], "Check its unit"),
        (1e-200 * data["u"], data["y"], "Check its unit"),
    ):
        with pytest.raises(BadInput, match=words):
            estimate(recording(u, y), "x", SETTINGS)
    with pytest.raises(BadInput, match=r"band is 0.5 to 300 Hz; allowed: some of 0.0009766 to 0.5 Hz"):
        estimate(recording(data["u"], data["y"], 1.0 - 1e-9), "x", SETTINGS)
    with pytest.raises(BadInput, match="axis is 'q'"):
        estimate(recording(data["u"], data["y"]), "q", SETTINGS)


def test_one_window_gives_a_response_without_uncertainty() -> None:
    """It is shown with a note; ``judged`` refuses it for a fit."""
    found = estimate(a_rigid(1025), "x", SETTINGS)
    assert found.windows == 1 and not found.frf.trusted.any() and "no uncertainty" in found.notes[0]
    with pytest.raises(BadInput, match="2 or more"):
        judged(found.frf)


def test_an_output_that_hardly_follows_is_said_and_a_narrow_excitation_is_not_blamed() -> None:
    """Noise against noise; in contrast, an axis excited only below 10 Hz, and one in strong noise."""
    data, random = rigid(30_000), np.random.default_rng(8)
    alien = estimate(recording(data["u"], random.normal(size=30_000)), "x", SETTINGS)
    assert any("hardly follows" in note for note in alien.notes)
    narrow = signal.lfilter(*signal.butter(6, 10.0, fs=RATE), data["u"])
    noisy = data["y"] + 3e-5 * random.normal(size=30_000)
    for u, y in ((narrow, plant(narrow, noise=1e-9)), (data["u"], noisy), (data["u"], data["y"])):
        assert not any("hardly follows" in note for note in estimate(recording(u, y), "x", SETTINGS).notes)


def test_split_keeps_the_last_part_for_the_check() -> None:
    """Each sample is in one of the two parts, together with its reference."""
    whole = replace(a_rigid(1000), reference=np.zeros((1000, 1)))
    first, last = split(whole, 0.2)
    assert (len(first), len(last)) == (800, 200) and last.seq[0] == 800 and last.reference is not None and len(last.reference) == 200
    assert len(split(whole, 0.0)[1]) == 0
    for wrong in (-0.1, 0.95, float("nan")):
        with pytest.raises(BadInput, match=r"0 to 0\.9"):
            split(whole, wrong)
