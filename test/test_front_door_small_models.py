"""Short tests, servos, two axes at once and numbers in SI from Python: as the commands, with printable results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from helpers.cli_tools import cli, refused
from scipy import signal

import xy_sysid as xy

RATE = 200.0


def step_test(level: float) -> xy.Recording:
    """A first order of 0.5 rad/s per unit with 0.1 s, from rest."""
    u = np.concatenate((np.zeros(20), np.full(200, level)))
    keep = float(np.exp(-1.0 / RATE / 0.1))
    speed = signal.lfilter([0.0, 0.5 * (1.0 - keep)], [1.0, -keep], u) + np.random.default_rng(3).normal(0.0, 1e-3, u.size)
    return xy.Recording.from_arrays(RATE, u, np.concatenate(([0.0], np.cumsum(speed[:-1]) / RATE)), units=("A", "rad"))


def test_step_tests_of_several_recordings_give_gain_and_inertia() -> None:
    """Gain, time constant and their sentences; with a torque constant and a gear the inertia at the joint and at the motor."""
    found = xy.steps([step_test(5.0), step_test(-5.0)])
    assert found["gain"].value == pytest.approx(0.5, rel=0.02) and found["time_constant"].value == pytest.approx(0.1, rel=0.05)
    assert found.sentences[0] in str(found) and "gain" in str(found.table) and "explains" in repr(found)
    rows = {str(row[0]): row for row in xy.mechanics(found, kt=0.12, gear="10")}
    assert rows["inertia"][1] == pytest.approx(0.12 * 10.0 * 0.1 / 0.5, rel=0.05)
    assert rows["inertia"][5] == pytest.approx(0.12 * 0.1 / 0.5 / 10.0, rel=0.05) and rows["inertia"][7] == "armature"
    assert len(xy.mechanics(found)) == 0


def test_a_current_moves_a_table_through_a_screw() -> None:
    """A screw of 5 mm a turn: force = kt current 2 pi / lead; mass in kg and damping at the table, inertia in kg m^2 at the motor."""
    screw = 2.0 * np.pi / 5e-3
    made = [step_test(5.0), step_test(-5.0)]
    found = xy.steps([xy.Recording.from_arrays(RATE, one.voltage[:, 0], 1e-2 * one.position[:, 0], units=("A", "m")) for one in made])
    rows = {str(row[0]): row for row in xy.mechanics(found, kt=0.12, gear="5mm")}
    mass, damping = rows["mass"], rows["damping"]
    assert mass[1] == pytest.approx(0.12 * screw * 0.1 / 0.5e-2, rel=0.05) and (mass[4], mass[6]) == ("kg", "kg m^2")
    assert mass[5] == pytest.approx(0.12 / screw * 0.1 / 0.5e-2, rel=0.05)
    assert damping[1] == pytest.approx(0.12 * screw / 0.5e-2, rel=0.02) and (damping[4], damping[6]) == ("N s/m", "N m s/rad")
    with pytest.raises(xy.BadInput, match="the way of one turn with its unit"):
        xy.mechanics(found, kt=0.12, gear="50")


@pytest.mark.parametrize("measured", ["rad", "rad/s"])
def test_a_transfer_function_of_a_current_gives_inertia_and_damping(tmp_path: Path, measured: str) -> None:
    """At the joint and at the motor, with the names of MuJoCo and URDF, from Python and from the command; without a torque constant nothing."""
    rng = np.random.default_rng(2)
    u = rng.normal(0.0, 1.0, 12_000)
    slow = np.array([0.1, 1.0] if measured == "rad/s" else [0.1, 1.0, 0.0])
    joint = signal.cont2discrete((np.array([0.5]), slow), 1.0 / RATE)
    y = signal.lfilter(np.ravel(joint[0]), joint[1], u) + rng.normal(0.0, 1e-5, u.size)
    np.savetxt(tmp_path / "joint.csv", np.column_stack((np.arange(u.size) / RATE, u, y)), "%.12g", ",", header="time,current,out", comments="")
    columns, units = {"input": "current", "output": "out"}, {"input": "A", "output": measured}
    found = xy.fit(xy.frf(xy.load(tmp_path / "joint.csv", columns=columns, units=units).run("x")))
    rows: dict[str, Any] = {str(row[0]): row for row in xy.mechanics(found, kt=0.12, gear="10")}
    assert rows["inertia"][1] == pytest.approx(0.12 * 10.0 * 0.1 / 0.5, rel=0.05) and rows["inertia"][2] < 0.24 < rows["inertia"][3]
    assert rows["damping"][5] == pytest.approx(0.12 / 0.5 / 10.0, rel=0.05) and rows["inertia"][7] == "armature"
    assert len(xy.mechanics(found)) == 0
    words = ("fit", tmp_path / "joint.csv", "--map", "input=current,output=out", "--unit", "input=A", "--unit", f"output={measured}")
    told = cli(*words, "--kt", "0.12", "--gear", "10", "--json").json["axes"]["x"]["mechanics"]
    assert told["inertia"]["value"] == pytest.approx(0.24, rel=0.05) and told["inertia"]["at_motor"]["unit"] == "kg m^2"
    assert "in SI, at the joint" in cli(*words, "--kt", "0.12", "--gear", "10").out
    assert refused(*words, "--kt", "-1").startswith("xy-sysid: --kt is -1")


def test_a_servo_gives_its_stiffness_and_the_numbers_of_mujoco(tmp_path: Path) -> None:
    """From a file, too; an inertia gives kp = inertia times stiffness."""
    rng = np.random.default_rng(1)
    target = np.repeat(rng.uniform(-0.5, 0.5, 24), 25)
    plant = signal.cont2discrete((np.array([400.0]), np.array([1.0, 28.0, 400.0])), 1 / 50.0)
    angle = signal.lfilter(plant[0].ravel(), plant[1], target)
    np.savetxt(tmp_path / "servo.csv", np.column_stack((np.arange(600) / 50.0, target, angle)), "%.9g", ",", header="time,target,angle", comments="")
    columns, units = {"input": "target", "output": "angle"}, {"input": "rad", "output": "rad"}
    found = xy.servo(xy.load(tmp_path / "servo.csv", columns=columns, units=units))
    assert found["stiffness"].value == pytest.approx(400.0, rel=0.1)
    rows = {str(row[0]): row for row in found.in_si(0.01)}
    assert rows["kp"][1] == pytest.approx(0.01 * found["stiffness"].value) and rows["kp"][5] is None
    assert {str(row[0]): row for row in found.in_si(0.01, gear="20")}["kp"][5] == pytest.approx(0.01 * found["stiffness"].value / 400)
    assert found.sentences[0] in str(found)
    with pytest.raises(xy.BadInput, match="inertia is -1"):
        found.in_si(-1.0)


def test_two_axes_at_once_give_a_verdict_and_a_picture() -> None:
    """The sentence, the bands as a table, and a figure; a recording of one axis is refused in one line."""
    rng = np.random.default_rng(2)
    u = rng.normal(size=(20_000, 2))
    moved = signal.lfilter([0.1], [1.0, -0.9], u + 0.05 * u[:, ::-1], axis=0)
    two = xy.Recording.from_arrays(500.0, u, np.cumsum(moved, axis=0) / 500.0, axes=("x", "y"))
    found = xy.coupling(two, band_low=2.0, band_high=100.0)
    assert not found.suffice and "do not suffice" in found.sentence and found.sentence in str(found)
    assert len(found.table) == len(found.coupling)
    assert isinstance(xy.plot.coupling(found), go.Figure)
    with pytest.raises(xy.BadInput, match="two"):
        xy.coupling(step_test(1.0))
    with pytest.raises(xy.BadInput, match="one axis"):
        xy.steps(two)
