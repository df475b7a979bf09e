"""Other position-dependent forces replace that of a removed effect: exactly, if together they are the same law."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xy_sysid.axis.model import STANDARD, AxisModel
from xy_sysid.effects import Scene
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.forces import force_moved_to_others, force_of, friction_of, position_forces, with_equal_force, with_force_from_trace

RATE = 1000.0


@pytest.fixture(scope="module")
def data() -> AxisData:
    """A slow motion back and forth over a centimetre; its drive is irrelevant here."""
    t = np.arange(20000) / RATE
    return prepare(RATE, np.random.default_rng(1).normal(size=t.size), 5e-3 * np.sin(2.0 * np.pi * 0.7 * t) + 1e-3 * np.sin(2.0 * np.pi * 3.1 * t))


def test_a_spring_takes_over_a_load_by_resting_elsewhere(data: AxisData) -> None:
    both = AxisModel(0.1, 1e-3, 100.0).with_effect("return_spring", (100.0, 2e-4, 8.7)).with_effect("constant_load", (5.0,))
    spring = force_moved_to_others(data, both.with_effect("coulomb_friction", (0.2,)), "constant_load")
    assert dict(spring.effects)["coulomb_friction"] == (0.2,)
    stiffness, rest, softening = dict(spring.effects)["return_spring"]
    assert stiffness == pytest.approx(100.0, rel=2e-3)
    assert rest == pytest.approx(-0.05, rel=5e-3)
    assert abs(softening) * rest**2 < 0.01
    counts = data.counts(early=True)
    wanted = force_of(data, both, "return_spring", counts) + 5.0
    assert force_of(data, spring, "return_spring", counts) == pytest.approx(wanted, abs=1e-4)


def test_what_alone_pushes_by_place_leaves_the_others_as_they_are(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (5.0,))
    assert position_forces(model) == ["constant_load"]
    assert force_moved_to_others(data, model, "constant_load") == model.without("constant_load")


def test_friction_is_not_taken_over_by_a_load(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (5.0,))
    assert force_moved_to_others(data, model, "coulomb_friction") == model.without("coulomb_friction")


def test_a_law_that_gives_no_number_takes_nothing_over(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0, (("hardening_stiffness", (np.nan, 0.0)), ("constant_load", (5.0,))))
    assert dict(force_moved_to_others(data, model, "constant_load").effects).keys() == {"hardening_stiffness"}


@pytest.mark.parametrize("gain", [0.1, -0.1])
def test_coulomb_friction_stands_in_for_stribeck_with_the_base_taking_what_falls_with_speed(data: AxisData, gain: float) -> None:
    """Friction and drag together are equal at every speed, and the inertia 1 / (gain pole) is unchanged."""
    model = AxisModel(gain, 1e-3, 100.0).with_effect("stribeck_friction", (0.25, 0.02, 0.1))
    found = with_equal_force(data, model, "stribeck_friction", STANDARD["coulomb_friction"])
    (level,) = dict(found.effects)["coulomb_friction"]
    assert 0.25 < level < 0.28
    assert abs(found.gain) > abs(gain) and math.copysign(1.0, found.gain) == math.copysign(1.0, gain)
    assert found.gain * found.pole == pytest.approx(model.gain * model.pole, rel=1e-12)
    law = STANDARD["stribeck_friction"].functions["level"]
    for speed in (0.005, 0.01, 0.02):
        before = law(excess=0.02, coulomb=0.25, velocity=0.1, v=speed) + speed / abs(gain)
        assert level + speed / abs(found.gain) == pytest.approx(before, rel=3e-3)


@pytest.mark.parametrize("gain", [0.1, -0.1])
def test_friction_that_grows_with_the_input_follows_the_measured_one(gain: float) -> None:
    """Its force is a share of the input's size, against the motion, whatever the sign of the gain."""
    random = np.random.default_rng(3)
    velocity, voltage, still = np.sin(np.arange(2000) / 50.0), random.standard_normal(2000), np.zeros(2000)
    scene = Scene(RATE, gain, 100.0, voltage, velocity, still, still)
    force = friction_of(scene, AxisModel(gain, 1e-3, 100.0).with_effect("load_dependent_friction", (0.3,)), "load_dependent_friction")
    fast = np.abs(velocity) > 0.1
    assert force[fast] == pytest.approx((0.3 * np.abs(voltage) * np.sign(velocity) * np.sign(gain))[fast], rel=1e-3)


def test_a_level_that_is_the_same_at_all_speeds_stays(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("asymmetric_friction", (0.3, 0.0))
    found = with_equal_force(data, model, "asymmetric_friction", STANDARD["coulomb_friction"])
    assert dict(found.effects)["coulomb_friction"] == pytest.approx((0.3,), rel=1e-6)
    assert (found.gain, found.pole) == pytest.approx((0.1, 100.0), rel=1e-6)


def scene(data: AxisData, model: AxisModel) -> Scene:
    """The scene of a base that explains nothing."""
    velocity = data.first_stage(data.velocity)
    position = data.first_stage(data.middle())
    voltage = data.first_stage(data.voltage[:-1])
    return Scene(sampling_rate=RATE, gain=model.gain, pole=model.pole, voltage=voltage, velocity=velocity, position=position, error=velocity)


def test_a_spring_that_softens_is_taken_for_a_part_of_a_wave_that_pushes_alike(data: AxisData) -> None:
    """Cogging with two thirds of a period within the travel, and an unchanged friction."""
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("coulomb_friction", (0.2,)).with_effect("return_spring", (40.0, 1e-3, 6000.0))
    found = with_force_from_trace(data, model, "return_spring", STANDARD["cogging"], scene(data, model))
    assert found is not None
    assert [name for name, _ in found.effects] == ["coulomb_friction", "cogging"]
    assert (found.gain, found.pole) == (0.1, 100.0)
    counts = data.counts(early=True)
    wanted, pushed = force_of(data, model, "return_spring", counts), force_of(data, found, "cogging", counts)
    assert np.std(wanted - pushed) < 0.03 * np.std(wanted)


def test_a_law_that_leaves_no_trace_on_this_motion_is_not_what_a_spring_was_taken_for(data: AxisData) -> None:
    """Gravity needs half a radian of travel; and friction is not a position force."""
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("return_spring", (40.0, 1e-3, 0.0))
    for other in ("gravity", "coulomb_friction"):
        assert with_force_from_trace(data, model, "return_spring", STANDARD[other], scene(data, model)) is None


def test_a_linear_spring_stands_in_for_one_that_softens_not(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("return_spring", (80.0, 0.0, 0.0))
    cubic, linear = dict(with_equal_force(data, model, "return_spring", STANDARD["hardening_stiffness"]).effects)["hardening_stiffness"]
    assert linear == pytest.approx(80.0, rel=1e-3)
    assert abs(cubic) * 6e-3**2 < 0.1


def test_laws_that_cannot_be_compared_begin_with_the_values_of_the_same_name(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("presliding_hysteresis", (0.3, 1e-5, 0.0))
    assert dict(with_equal_force(data, model, "presliding_hysteresis", STANDARD["coulomb_friction"]).effects)["coulomb_friction"] == (0.3,)
