"""Presliding friction at rest: encoder noise causes small motion, the friction relaxes, and the feedforward takes it into account."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.known_models import axis, known

from xy_sysid.control_design.closed_loop import Controller, Encoder, follow_path, shake
from xy_sysid.control_design.compensation import alike, compensate
from xy_sysid.control_design.gains import gains
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.path import Bounds, SampledPath, s_curve
from xy_sysid.control_design.worth import encoder_of_floor

RATE = 2000.0
STIFF = Controller(kp=5000.0, ki=6e5, kd=10.0, derivative_time=2e-4, limit=10.0)  # by the rules of Ziegler and Nichols
NOISY = Encoder(noise=1e-7, count=5e-7)


@pytest.fixture(scope="module")
def path() -> SampledPath:
    """Forth and back with rests, in which friction relaxes."""
    return s_curve([0.0, 0.01, -0.01, 0.0], Bounds(0.06, 1.0, 50.0), RATE)


def test_noise_shakes_a_resting_axis_and_no_noise_does_not() -> None:
    """The mean absolute speed at rest grows with the noise; quantisation is noise with a variance of a twelfth of a squared count."""
    model = known("presliding_hysteresis").model
    speeds = [shake(model, 0.0, RATE, STIFF, Encoder(noise)) for noise in (0.0, 1e-7, 2e-7)]
    assert speeds[0] == 0.0 < speeds[1] < speeds[2]
    assert Encoder(1e-7, 5e-7).white.noise == pytest.approx(np.sqrt(1e-14 + 25e-14 / 12.0))


def test_the_feedforward_that_expects_the_shaking_leaves_a_third_of_the_error(path: SampledPath) -> None:
    """Without the relaxation, the friction's spring would be assumed to be deflected at the next start."""
    model = known("presliding_hysteresis").model
    noise = shake(model, 0.0, RATE, STIFF, NOISY)
    errors = [follow_path(model, path, STIFF, feedforward(model, path, expected).voltage, NOISY, seed=5).rms for expected in (0.0, noise)]
    assert errors[1] < errors[0] / 3.0, errors


def test_the_shaking_is_no_matter_where_nothing_remembers(path: SampledPath) -> None:
    """Coulomb friction has no state."""
    model = known("coulomb_friction").model
    assert np.array_equal(feedforward(model, path, 1e-3).voltage, feedforward(model, path).voltage)


def test_the_compensation_undoes_presliding_friction_under_a_noisy_encoder(path: SampledPath) -> None:
    """In simulation with the noise its error is at most a third of that with kS, kV and kA."""
    model = known("presliding_hysteresis")
    made = compensate((model.model,), gains(model), path, STIFF, NOISY)
    assert "presliding_hysteresis" in made.terms and made.chosen < made.simple / 3.0


def test_the_encoder_follows_from_a_noise_floor() -> None:
    """A floor of the velocity below 700 Hz and the white noise that makes it."""
    random = np.random.default_rng(1)
    velocity = np.diff(1.5e-7 * random.standard_normal(200_000)) * RATE
    lines = np.abs(np.fft.rfft(velocity)) ** 2
    floor = np.sqrt(2.0 * np.sum(lines[: round(0.35 * velocity.size)])) / velocity.size
    assert encoder_of_floor(float(floor), RATE).noise == pytest.approx(1.5e-7, rel=0.02)


def test_a_breakaway_that_no_sample_shows_is_not_relied_upon() -> None:
    """Stribeck friction whose excess vanishes within a sample cannot be distinguished from Coulomb friction: the compensation must suit both."""
    seen, unseen = (replace(axis(), effects=(("stribeck_friction", (0.2, 0.1, speed)),)) for speed in (5e-3, 1e-6))
    assert alike(seen, RATE) == ()
    (other,) = alike(unseen, RATE)
    assert other.effects == (("coulomb_friction", (0.2,)),)
