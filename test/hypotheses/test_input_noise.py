"""Measurement noise on the input is distinguished from a missing effect."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import butter, sosfilt

from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.diagnosis.diagnose import diagnose_prepared
from xy_sysid.greybox.axis_data import AxisData, prepare_all
from xy_sysid.greybox.free_run import fit_base
from xy_sysid.hypotheses.input_noise import input_noise
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units

RATE = 200.0
JOINT = AxisModel(0.4, 0.0, 8.0)


def joint(model: AxisModel, noise: FloatArray, seed: int = 3) -> AxisData:
    """60 s of a joint whose current is measured with noise, A to rad."""
    random = default_rng(seed)
    current = 2.0 * sosfilt(butter(2, 3.0, fs=RATE, output="sos"), random.standard_normal(12_000))
    speed = simulate(model, RATE, current, np.zeros_like(current))
    angle = np.concatenate(([0.0], np.cumsum(speed)[: current.size - 1])) / RATE + 2e-5 * random.standard_normal(current.size)
    return prepare_all(RATE, [(current + noise, angle)], units=Units("A", "rad"))


def test_white_noise_on_the_input_is_nothing_that_is_missing() -> None:
    """Its rms is recovered, and the verdict says that it is on the input."""
    data = joint(JOINT, 0.05 * default_rng(8).standard_normal(12_000))
    assert input_noise(data, fit_base(data)) == pytest.approx(0.05, rel=0.1)
    found = diagnose_prepared(data)
    assert found.verdict == "nothing_missing"
    assert "white noise of 0.0" in found.sentence and "A rms on the input" in found.sentence


def test_a_slow_force_that_nobody_modelled_is_no_noise() -> None:
    """A force like that of a cable or wandering friction: its spectrum falls with frequency."""
    slow = sosfilt(butter(1, 0.3, fs=RATE, output="sos"), default_rng(8).standard_normal(12_000))
    data = joint(JOINT, 0.05 * slow / np.std(slow))
    assert input_noise(data, fit_base(data)) is None


def test_friction_is_no_noise() -> None:
    """Its residual error follows the motion."""
    data = joint(JOINT.with_effect("coulomb_friction", (0.2,)), 0.01 * default_rng(8).standard_normal(12_000))
    assert input_noise(data, fit_base(data)) is None
    assert diagnose_prepared(data).effects == ("coulomb_friction",)
