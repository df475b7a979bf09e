"""Measured speed and acceleration: response, fit, comparison and diagnosis in that quantity and unit."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.real_data import data
from scipy import signal

import xy_sysid as xy
from xy_sysid.imports.motion import as_position
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.units import Sensed

RATE, FINE, SECONDS = 1000.0, 10, 40.0
GAIN, POLE, FREQUENCY, DAMPING, SPLIT = 0.4, 30.0, 60.0, 0.01, 0.6  # a motor with a load on a spring, behind a held torque


def machine(kind: Sensed, friction: float = 0.0, noise: float = 1e-3) -> tuple[Recording, FloatArray]:
    """Torque to speed, or band-limited torque to acceleration, sampled at the instants; and the torque."""
    n = int(SECONDS * RATE)
    rng = np.random.default_rng(4)
    zero = 2 * np.pi * FREQUENCY * SPLIT
    pole = 2 * np.pi * FREQUENCY
    lift = np.array([1.0, 2 * DAMPING * zero, zero**2]) / zero**2
    drop = np.array([1.0, 2 * DAMPING * pole, pole**2]) / pole**2
    top, bottom = GAIN * POLE * lift, np.asarray(np.polymul([1.0, POLE], drop), dtype=np.float64)
    held: FloatArray
    if kind == "velocity":
        u = np.asarray(rng.normal(0.0, 2.0, n), dtype=np.float64)
        fine, held = RATE * FINE, np.repeat(u, FINE)
    else:
        fine = RATE * FINE
        smooth = signal.butter(6, 150.0, fs=fine, output="sos")
        held = np.asarray(signal.sosfilt(smooth, rng.normal(0.0, 2.0 * np.sqrt(FINE), n * FINE)))
        u, top = np.asarray(held[::FINE], dtype=np.float64), np.append(top, 0.0)
    b, a, _ = signal.cont2discrete((top, bottom), 1.0 / fine, "zoh" if kind == "velocity" else "bilinear")
    y = signal.lfilter(np.ravel(b), a, held - friction * np.sign(held))[::FINE]
    y = y + noise * np.std(y) * rng.normal(size=n)
    found = Recording.from_arrays(RATE, u, y, units=("N m", "rad/s" if kind == "velocity" else "rad/s^2"))
    return as_position(Recording(**{name: getattr(found, name) for name in found.__slots__} | {"measured": kind})), u


@pytest.mark.parametrize(("kind", "unit"), [("velocity", "rad/s"), ("acceleration", "rad/s^2")])
def test_response_and_fit_are_of_what_was_measured(kind: Sensed, unit: str) -> None:
    """Mobility or accelerance with its unit; resonance, antiresonance and velocity gain within their intervals, no effect missing."""
    recording, _ = machine(kind)
    response = xy.frf(recording, band_low=1.0, band_high=120.0)
    assert response.output_unit == unit and recording.output_unit == "rad"
    model = xy.fit(response)
    estimates = {item.name: item for item in model.intervals_with_misfit}
    assert model.tf.output_unit == unit and model.tf.delay < 1e-4
    assert estimates["resonance_1.frequency"].value == pytest.approx(FREQUENCY, rel=2e-3)
    assert estimates["antiresonance_1.frequency"].value == pytest.approx(FREQUENCY * SPLIT, rel=2e-3)
    if kind == "velocity":
        assert estimates["gain"].value == pytest.approx(GAIN, rel=0.02) and estimates["gain"].unit == "rad/s/(N m)"


def test_an_error_of_an_acceleration_is_told_in_its_unit() -> None:
    """compare, diagnose and better judge the acceleration, with the noise of its sensor as floor."""
    recording, _ = machine("acceleration", noise=0.02)
    run = recording.run("x")
    model = xy.fit(xy.frf(run, band_low=1.0, band_high=120.0))
    compared = xy.compare(run, model)
    assert compared.unit == "rad/s^2"
    own = 0.02 * float(np.std(run.sensed[1]))
    assert compared.noise_floor == pytest.approx(own * np.sqrt(0.7), rel=0.2)  # of the judged band
    assert compared.error < 2.0 * compared.noise_floor
    found = xy.diagnose(run)
    assert "rad/s^2" in found.sentence and found.units.judged == "rad/s^2"


def test_the_noise_of_a_tachometer_is_white_in_speed() -> None:
    """The floor of a measured speed is its sensor's noise at every frequency, so a rigid axis with that noise has no missing effect."""
    rng = np.random.default_rng(3)
    u = rng.normal(0.0, 2.0, 30_000)
    keep = np.exp(-POLE / RATE)
    v = signal.lfilter([0.0, GAIN * (1 - keep)], [1.0, -keep], u)
    y = v + 0.01 * rng.normal(size=u.size)
    found = Recording.from_arrays(RATE, u, y, units=("V", "m/s"))
    recording = as_position(Recording(**{name: getattr(found, name) for name in found.__slots__} | {"measured": "velocity"}))
    answer = xy.diagnose(recording)
    assert answer.verdict == "nothing_missing", answer.sentence
    assert answer.noise == pytest.approx(0.01 * np.sqrt(0.7), rel=0.15)


def test_the_flexible_arm_of_daisy() -> None:
    """Torque to acceleration: modes at 29 and 63.35 Hz, zeros at 16 and 92 Hz, in rad/s^2/(N m)."""
    recording = xy.load(data("daisy/robot_arm.dat"), columns={"input": "1", "output": "2"}, units={"input": "N m", "output": "rad/s^2"}, rate=500)
    model = xy.fit(xy.frf(recording))
    assert model.tf.output_unit == "rad/s^2"
    assert [mode.frequency for mode in model.tf.pole_modes()] == pytest.approx([29.2, 63.36], abs=0.2)
    assert [mode.frequency for mode in model.tf.zero_modes()] == pytest.approx([16.0, 92.0], abs=1.0)
