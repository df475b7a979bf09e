"""Short step and ramp tests: first order with delay and friction, and undetermined quantities."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import cli
from helpers.real_data import data
from helpers.table_making import csv_of

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run
from xy_sysid.time_models.as_words import first_order_words
from xy_sysid.time_models.first_order import first_order

RATE, GAIN, CONSTANT, DELAY, FRICTION = 200.0, 0.5, 0.12, 0.013, 0.8
FINE = 50  # steps of the machine in a sample


def moved(u: FloatArray, friction: float = FRICTION, seed: int = 1, delay: float = DELAY) -> Run:
    """A first-order axis with friction, by Euler steps, and tachometer noise."""
    late, v, speeds = int(delay * RATE * FINE), 0.0, []
    held = np.concatenate((np.full(late, u[0]), np.repeat(u, FINE)))
    for n in range(len(u)):
        speeds.append(v)
        for drive in held[n * FINE : (n + 1) * FINE]:
            against = friction * np.sign(v) if v else np.clip(drive, -friction, friction)
            after = v + (GAIN * (drive - against) - v) / CONSTANT / RATE / FINE
            v = 0.0 if v * after < 0.0 else after
    measured = np.array(speeds) + np.random.default_rng(seed).normal(0.0, 0.01, len(u))
    position = np.concatenate(([0.0], np.cumsum(measured[:-1]) / RATE))
    return Run("x", RATE, u, position, output_unit="rad", measured="velocity")


def both_ways(delay: float = DELAY) -> list[Run]:
    """Ramp and step, both ways, as robot builders do it: four short recordings."""
    ramp = np.linspace(0.0, 6.0, 600)
    step = np.concatenate((np.zeros(20), np.full(160, 5.0)))
    return [moved(u, seed=k, delay=delay) for k, u in enumerate((ramp, -ramp, step, -step))]


def test_ramps_and_steps_both_ways_tell_friction_gain_and_time_constant() -> None:
    """kS, kV and kA within a few per cent, each inside its interval, the delay to a fifth of a sample."""
    found = first_order(both_ways())
    for name, true in (("kS", FRICTION), ("kV", 1 / GAIN), ("kA", CONSTANT / GAIN), ("time_constant", CONSTANT)):
        assert found[name].value == pytest.approx(true, rel=0.04), name
        assert found[name].low - 0.02 * true <= true <= found[name].high + 0.02 * true, name
    assert found["delay"].value == pytest.approx(DELAY, abs=0.001)
    assert found.explained > 0.99 and found["kV"].unit == "V/(rad/s)"
    assert "explains" in first_order_words(found)[0]


def test_a_delay_that_ends_at_zero_hides_no_friction() -> None:
    """A command that is logged a sample late seems to follow the motion: a parameter at its bound is judged like any other."""
    late = [replace(run, voltage=np.concatenate((run.voltage[:1], run.voltage[:-1]))) for run in both_ways(delay=0.0)]
    found = first_order(late)
    assert found["delay"].value < 1e-9 and found["delay"].high < 0.01
    assert found["friction"].value == pytest.approx(FRICTION, rel=0.04) and found["time_constant"].told


def test_one_level_in_one_direction_does_not_tell_the_friction() -> None:
    """With one step from rest only gain (u - friction) is determined: the answer says so instead of a number."""
    found = first_order([moved(np.concatenate((np.zeros(20), np.full(200, 5.0))))])
    assert "friction" not in [item.name for item in found.quantities]
    assert any("friction" in sentence and "distinguished" in sentence for sentence in first_order_words(found))
    assert found["time_constant"].value == pytest.approx(CONSTANT, rel=0.15)


def test_a_level_that_ends_too_soon_is_extrapolated_and_that_is_said() -> None:
    """The step is shorter than the three time constants that a first order needs."""
    found = first_order([moved(np.concatenate((np.zeros(10), np.full(24, 5.0))), 0.0)])
    assert any("extrapolated" in sentence for sentence in first_order_words(found))


def test_what_is_left_out_of_a_long_recording_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples after the first 20,000 are not used; here after the first 1000 of 1560."""
    assert first_order(both_ways()).unused == 0.0
    monkeypatch.setattr("xy_sysid.time_models.first_order.MOST", 1000)
    found = first_order(both_ways())
    assert found.unused == pytest.approx(560 / RATE)
    assert any("The remaining 2.8 s of the data are not used" in sentence for sentence in first_order_words(found))


def test_an_input_that_never_changes_is_refused() -> None:
    """It determines nothing."""
    run = moved(np.zeros(100))
    with pytest.raises(BadInput, match="one and the same"):
        first_order([run])


def test_a_delay_that_no_step_shows_is_unknown_and_within_what_was_looked_for() -> None:
    """Levels that change only between recordings: the gain is determined, the delay is not, and the answer says so."""
    found = first_order([moved(np.full(200, level), 0.0, seed=k) for k, level in enumerate((5.0, -5.0, 2.0))])
    assert found["gain"].value == pytest.approx(GAIN, rel=0.05)
    assert found["delay"].low >= 0.0 and found["delay"].high <= 0.5 * 200 / RATE
    assert any("The delay is unknown: any up to 498 ms" in sentence for sentence in first_order_words(found))


def test_the_command_gives_si_with_a_torque_constant(tmp_path: Path) -> None:
    """Inertia, damping and friction at the joint and at the motor, in the names of MuJoCo and URDF."""
    paths = []
    for k, run in enumerate(both_ways()):
        u, v, _ = run.sensed
        recorded = csv_of(tmp_path, {"time": np.arange(len(u)) / RATE, "current [A]": u, "speed [rad/s]": v})
        paths.append(recorded.rename(tmp_path / f"{k}.csv"))
    found = cli("steps", *paths, "--kt", "0.12", "--gear", "50", "--json").json["axes"]["x"]["mechanics"]
    assert found["inertia"]["value"] == pytest.approx(0.12 * 50 * CONSTANT / GAIN, rel=0.05) and found["inertia"]["unit"] == "kg m^2"
    assert found["inertia"]["at_motor"]["value"] == pytest.approx(found["inertia"]["value"] / 2500)
    assert found["friction"]["value"] == pytest.approx(0.12 * 50 * FRICTION, rel=0.05) and found["friction"]["robot_name"] == "frictionloss"
    assert "inertia" in cli("steps", *paths, "--kt", "0.12").out
    assert "an input in A" in cli("steps", paths[0], "--kt", "0.12", "--unit", "input=V").err


def test_the_step_of_a_ctrlx_drive() -> None:
    """1.075 rpm/% with a lag of 36 ms and a delay of 172 ms, from the drive's own command."""
    said = ("--map", "input=PID_OUT,output=Velocidad_Scaled", "--unit", "input=%,output=rpm", "--json")
    found = cli("steps", data("vendor_exports/ctrlx_step.trace.csv"), *said).json["axes"]["x"]["quantities"]
    assert found["gain"]["value"] * 60 / (2 * np.pi) / 100 == pytest.approx(1.075, rel=0.005)
    assert found["time_constant"]["value"] == pytest.approx(0.036, abs=0.003) and found["delay"]["value"] == pytest.approx(0.172, abs=0.003)
