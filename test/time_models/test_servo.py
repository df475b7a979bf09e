"""Position-controlled servos: the controller is part of the model."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.cli_tools import cli, refused
from helpers.real_data import data

from xy_sysid.axis.mechanics import robot_parameters
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.time_models.as_words import servo_words
from xy_sysid.time_models.servo import servo
from xy_sysid.units import Units

RATE, STIFFNESS, DAMPING, FRICTION, LIMIT, DELAY = 100.0, 900.0, 40.0, 4.0, 60.0, 0.025


def followed(target: FloatArray, limit: float, seed: int) -> Run:
    """A joint with its controller, in steps of 20 us, with an encoder of 1 mrad."""
    steps = 500
    q, v, late, angles = 0.0, 0.0, round(DELAY * RATE * steps), []
    held = np.concatenate((np.zeros(late), np.repeat(target, steps)))
    for n in range(len(target)):
        angles.append(q)
        for wanted in held[n * steps : (n + 1) * steps]:
            drive = float(np.clip(STIFFNESS * (wanted - q), -limit, limit)) - DAMPING * v
            drive -= FRICTION * np.sign(v) if v else float(np.clip(drive, -FRICTION, FRICTION))
            after = v + drive / RATE / steps
            v = 0.0 if v * after < 0.0 else after
            q += v / RATE / steps
    noise = np.random.default_rng(seed).uniform(-5e-4, 5e-4, len(target))
    return Run("x", RATE, target, np.array(angles) + noise, input_unit="rad", output_unit="rad")


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    """Eight short recordings: steps, ramps and chirps of several sizes, the large ones at the torque limit."""
    t = np.arange(90) / RATE
    targets = [size * np.sign(np.sin(7.0 * t + size)) for size in (0.05, 0.2, 0.6, 0.8)]
    targets += [size * np.sin(2 * np.pi * (0.5 + 2.5 * t) * t) for size in (0.1, 0.3, 0.5)] + [0.4 * t]
    return [followed(np.where(t > 0.05, target, 0.0), LIMIT, k) for k, target in enumerate(targets)]


def test_short_recordings_together_tell_controller_friction_limit_and_delay(runs: list[Run]) -> None:
    """Every number over the inertia within 10 %; the simulation of held-out recordings is nearly right."""
    found = servo(runs)
    for name, true in (("stiffness", STIFFNESS), ("damping", DAMPING), ("friction", FRICTION), ("limit", LIMIT)):
        assert found[name].value == pytest.approx(true, rel=0.1), name
    assert found["delay"].value == pytest.approx(DELAY, abs=0.002)
    assert found.explained > 0.99 and found.at_limit > 0.05


def test_what_target_and_angle_cannot_tell_is_said(runs: list[Run]) -> None:
    """Without an inertia there are only ratios; with one, MuJoCo's numbers in SI."""
    found = servo(runs)
    assert any("determine only ratios to the inertia" in text for text in servo_words(found, None))
    assert any("derivative gain" in text for text in servo_words(found, 0.01))
    known = {item.name: item for item in robot_parameters(found.quantities, found.units, 0.01)}
    assert set(known) == {"armature", "kp", "damping", "frictionloss", "forcerange"}
    assert known["kp"].value == pytest.approx(9.0, rel=0.1) and known["kp"].unit == "N m/rad"


def test_a_gear_gives_the_numbers_of_the_motor(runs: list[Run]) -> None:
    """MuJoCo's actuator with gear 50: torques smaller by 50, stiffness, damping and inertia by 2500; a linear servo in kg, N/m and N."""
    found = servo(runs)
    known = {item.name: item for item in robot_parameters(found.quantities, found.units, 0.01, "50")}
    for name, power in (("armature", 2), ("kp", 2), ("damping", 2), ("frictionloss", 1), ("forcerange", 1)):
        assert known[name].at_motor == pytest.approx(known[name].value / 50**power) and known[name].motor_unit == known[name].unit
    linear = {item.name: item for item in robot_parameters(found.quantities, Units("m", "m"), 3.0, "5mm")}
    kp, limit = linear["kp"], linear["forcerange"]
    assert (kp.unit, kp.motor_unit, limit.unit, limit.motor_unit, linear["armature"].unit) == ("N/m", "N m/rad", "N", "N m", "kg")
    assert kp.value == pytest.approx(3.0 * STIFFNESS, rel=0.1) and kp.at_motor == pytest.approx(kp.value * (5e-3 / (2 * np.pi)) ** 2)
    with pytest.raises(BadInput, match="one in rad or m"):
        robot_parameters(found.quantities, Units("counts", "counts"), 0.01)


def test_a_limit_that_is_never_reached_is_not_told(runs: list[Run]) -> None:
    """Small motions: the answer is a bound, and a test that would give a number."""
    small = [followed(0.03 * run.voltage, 1e9, k) for k, run in enumerate(runs[2:5])]
    found = servo(small)
    assert "limit" not in [item.name for item in found.quantities]
    assert any("limit is not reached" in text for text in servo_words(found, None))


def test_a_voltage_is_no_target(runs: list[Run]) -> None:
    """Input and output need one and the same unit."""
    with pytest.raises(BadInput, match="a target and a position"):
        servo([Run("x", RATE, runs[0].voltage, runs[0].position, input_unit="V", output_unit="rad")])


def test_96_short_recordings_of_a_hobby_servo_are_used_together() -> None:
    """Each has at most 150 samples; the simulation from the target alone explains most of the held-out data."""
    said = ("--map", "input=data[*].actions,output=data[*].sensor_data", "--rate", "50", "--unit", "input=rad,output=rad", "--json")
    found = cli("servo", data("servo_target/response.json"), *said, "--inertia", "0.002", "--gear", "50").json["axes"]["x"]
    assert found["recordings"] > 60 and found["explained"] > 0.95
    kp = found["quantities"]["kp"]
    assert kp["at_motor"] == {"value": pytest.approx(kp["value"] / 2500), "unit": "N m/rad"}
    assert "give --inertia, too" in refused("servo", data("servo_target/chirp0.csv"), "--gear", "50")
    assert found["quantities"]["delay"]["value"] == pytest.approx(0.044, abs=0.004) and found["quantities"]["kp"]["unit"] == "N m/rad"
