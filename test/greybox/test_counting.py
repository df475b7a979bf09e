"""Quantisation noise of an encoder: white with many counts per sample, at low frequency with few."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from xy_sim.machine import Machine
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.excitation.lockstep import drive
from xy_sysid.greybox.floor import Windows, bands, counted, encoder_noise, floor
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

RATE, SAMPLES = 2000.0, 60_000


def moved(top: float) -> FloatArray:
    """(n,) m/s, noise below a frequency, of 1 m/s."""
    noise = np.random.default_rng(3).standard_normal(SAMPLES)
    speed = scipy.signal.sosfiltfilt(scipy.signal.butter(2, top, fs=RATE, output="sos"), noise)
    return np.asarray(speed / np.std(speed))


@pytest.mark.parametrize("top", [10.0, 40.0, 150.0])
@pytest.mark.parametrize("counts", [0.1, 0.3, 3.0, 100.0])
def test_the_floor_of_counts_is_what_counting_adds(counts: float, top: float) -> None:
    """0.1 to 100 counts rms per sample: every band within a factor of 2.5, most within a half."""
    speed = moved(top)
    count = 1.0 / (counts * RATE)
    position = np.cumsum(speed) / RATE
    shown = np.round(position / count) * count
    velocity = np.diff(shown) * RATE
    layout = bands(RATE, 4096)
    windows = Windows(layout, np.arange(0, SAMPLES - 4096, 2048))
    added = layout.power(windows.spectrum(velocity - speed[1:]))
    least = floor(windows, velocity, encoder_noise(RATE, shown), 1e-3)
    ratio = least.noise / added
    assert np.all((ratio > 0.4) & (ratio < 2.5))
    assert np.mean((ratio > 0.6) & (ratio < 1.6)) > 0.8
    assert 0.75 < layout.rms(least.noise) / layout.rms(added) < 1.3


def test_many_counts_a_sample_are_white_and_few_are_slow() -> None:
    """The total power is constant, spread up to Nyquist or below the rate of the counts."""
    layout = bands(RATE, 4096)
    many, few = (counted(layout, moved(40.0), 1.0 / (counts * RATE), 100.0) for counts in (100.0, 0.1))
    assert np.all(np.abs(many - 1.0) < 0.1)
    assert np.mean(few[layout.frequency < 60.0]) > 3.0 > 0.7 > np.mean(few[layout.frequency > 600.0])


def test_an_axis_behind_a_coarse_encoder_is_not_blamed_for_its_counts() -> None:
    """An axis without effects that moves over 19 counts: no confident answer, and the residual is noise."""
    machine = Machine.from_file("rigid.yaml", 21)
    axis = machine.spec.axes[0]
    coarse = replace(axis, drive=axis.drive.model_copy(update={"counts_per_revolution": 50.0}))
    settings = ExcitationSettings(lockstep=True, speed=0.0, axes={"x": AxisExcitation(seed=21, rms=0.15)})
    found = diagnose(RATE, *drive(Machine(replace(machine.spec, axes=(coarse,))), settings, 30.0, lambda _: None).axis("x"))
    assert found.effects == () and found.confidence < 0.1
    assert found.discrepancy < 0.1 * found.noise


def test_an_axis_that_runs_far_one_way_makes_no_overflow() -> None:
    """A motor after millions of revolutions: its mean speed is not noise, and no warning is printed."""
    position = 1e80 * np.arange(20_000.0) / RATE + np.random.default_rng(1).normal(size=20_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(encoder_noise(RATE, position))
        slow = 10.0 * np.arange(20_000.0) / RATE + 1e-3 * np.random.default_rng(1).normal(size=20_000)
        assert encoder_noise(RATE, slow) == pytest.approx(1e-3, rel=0.2)
