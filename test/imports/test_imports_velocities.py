"""Bags of joint states with velocities only: loaded, fitted, diagnosed and replayed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.bag_making import joint_state
from helpers.cli_tools import cli, refused

from xy_sysid.bags import BagWriter, stream_blocks
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.bags.streaming import Topics
from xy_sysid.bags.stride import Indices
from xy_sysid.errors import BadRecording
from xy_sysid.imports import load
from xy_sysid.samples.block import Block, FloatArray

EMPTY, RATE = np.zeros(0), 200.0
UNITS = {"input": "N m", "output": "rad"}


def wheels(samples: int = 4000) -> tuple[FloatArray, FloatArray]:
    """(samples, 2) effort in N m and velocity in rad/s of two wheels of 3 and 6 rad/s/(N m) with a pole at 20 rad/s.

    The velocity is a drive's difference of its encoder: the mean of the previous sample.
    """
    effort, velocity = np.random.default_rng(2).normal(size=(samples, 2)), np.zeros((samples, 2))
    speed, kept = np.zeros(2), np.exp(-20.0 / RATE)
    for n in range(samples - 1):
        lasting = np.array([3.0, 6.0]) * effort[n]
        velocity[n + 1] = lasting + (speed - lasting) * (1 - kept) * RATE / 20.0
        speed = lasting + (speed - lasting) * kept
    return effort, velocity + 1e-3 * np.random.default_rng(3).normal(size=velocity.shape)


def wheel_bag(path: Path, position: float | None = None, kept: Indices | None = None, voltage: bool = False) -> tuple[FloatArray, FloatArray]:
    """A bag of both wheels, with their drivers' positions (None: none); returns effort and velocity of all samples.

    kept: numbers of the samples that are not lost; voltage: the command is in blocks, without effort
    """
    effort, velocity = wheels()
    clock = 1_700_000_000.0
    with BagWriter(path) as writer:
        for count in range(len(effort)) if kept is None else kept.tolist():
            stamp = round((clock + count / RATE) * 1e9)
            if voltage and count % 20 == 0:
                seq = np.arange(count, count + 20.0)
                writer.write_block("/xy/voltage", Block(("left", "right"), seq, clock + seq / RATE, effort[count : count + 20]), stamp - 1)
            said = EMPTY if position is None else np.full(2, position)
            message = joint_state(stamp, said, None if voltage else effort[count], ("left", "right"), velocity=velocity[count])
            writer.write_raw("/joint_states", JOINT_TYPE, message, stamp)
    return effort, velocity


@pytest.mark.parametrize("position", [None, np.nan])
def test_a_bag_without_positions_is_read_by_its_velocities_and_that_is_said(tmp_path: Path, position: float | None) -> None:
    """Empty or NaN: each step of the position is the measured velocity; in rad, for a given unit of rad or rad/s."""
    effort, velocity = wheel_bag(tmp_path / "bag", position)
    for output in ("rad", "rad/s"):
        found = load(tmp_path / "bag", effort_as_voltage=True, units={**UNITS, "output": output})
        assert found.units == ("N m", "rad") and found.measured == "velocity"
        np.testing.assert_array_equal(found.voltage, effort)
        np.testing.assert_allclose(np.diff(found.position, axis=0) * RATE, velocity[:-1], atol=1e-5)
    assert "/joint_states gives no positions; the velocity of the joints is the output" in found.notes
    assert any("is a velocity (rad/s)" in note and "half a sample (2.5 ms)" in note for note in found.notes)
    plain, usual = load(tmp_path / "bag"), load(tmp_path / "bag", effort_as_voltage=True)
    assert plain.units == ("effort", "position") and plain.measured == "velocity"
    assert usual.units == ("V", "m") and any("velocity as m/s" in note and "output=rad/s" in note for note in usual.notes)
    np.testing.assert_allclose(load(tmp_path / "bag", units={"output": "rpm"}).position, found.position * np.pi / 30, atol=1e-12)


def test_positions_that_are_there_are_taken_unless_velocities_are_asked_for(tmp_path: Path) -> None:
    """A wrapped angle is a position, unless --velocity is given."""
    _, velocity = wheel_bag(tmp_path / "bag", 0.5)
    assert load(tmp_path / "bag", effort_as_voltage=True).measured == "position"
    asked = load(tmp_path / "bag", effort_as_voltage=True, velocity=True, units=UNITS)
    np.testing.assert_allclose(np.diff(asked.position, axis=0) * RATE, velocity[:-1], atol=1e-5)
    assert not any("gives no positions" in note for note in asked.notes)
    with pytest.raises(BadRecording, match="1 names with 0 velocities and 1 efforts"):
        with BagWriter(tmp_path / "none") as writer:
            for i in range(1, 100):
                writer.write_raw("/joint_states", JOINT_TYPE, joint_state(i * 5_000_000, np.ones(1), np.ones(1), ("left",)), i)
        load(tmp_path / "none", velocity=True)


def test_joints_that_are_chosen_decide_and_not_those_beside_them(tmp_path: Path) -> None:
    """A gripper with a position and wheels without: for the wheels the velocity is the output."""
    effort, velocity = wheels(400)
    with BagWriter(tmp_path / "bag") as writer:
        for n in range(400):
            names = ("gripper", "left", "right") if n % 2 else ("left", "gripper", "right")
            told = {"gripper": (0.1, 0.0, np.nan), "left": (np.nan, velocity[n, 0], effort[n, 0]), "right": (np.nan, velocity[n, 1], effort[n, 1])}
            position, speed, drive = (np.array([told[name][k] for name in names]) for k in range(3))
            message = joint_state(10**9 + n * 5_000_000, position, drive, names, velocity=speed)
            writer.write_raw("/joint_states", JOINT_TYPE, message, n)
    found = load(tmp_path / "bag", effort_as_voltage=True, joints=("x=right",))
    assert found.axes == ("x",) and found.measured == "velocity"
    np.testing.assert_allclose(np.diff(found.position[:, 0]) * RATE, velocity[:-1, 1], atol=1e-9)


def test_gaps_of_a_bag_of_velocities_leave_both_sides_right(tmp_path: Path) -> None:
    """Lost samples, and a NaN, separate the runs; within each every step is the measured one."""
    kept = np.delete(np.arange(4000), np.r_[1000:1040, 2500])
    _, velocity = wheel_bag(tmp_path / "bag", None, kept)
    found = load(tmp_path / "bag", effort_as_voltage=True)
    assert len(found.runs()) == 3
    for run in found.runs():
        rows = found.seq[run]
        np.testing.assert_allclose(np.diff(found.position[run], axis=0) * found.sampling_rate, velocity[rows[:-1]], atol=1e-9)


def test_fit_and_diagnose_of_wheels_answer_in_rad(tmp_path: Path) -> None:
    """Gain of each wheel in rad/s/(N m), half a sample of delay by the differenced encoder, and no missing effect."""
    wheel_bag(tmp_path / "bag")
    said = ("--effort", "--unit", "input=N m,output=rad")
    options = ("--set", "length=512", "--set", "band_high=60", "--set", "numerator_order=0", "--set", "denominator_order=2", "--json")
    axes = cli("fit", tmp_path / "bag", *said, *options).json["axes"]
    for name, gain in (("left", 3.0), ("right", 6.0)):
        function, estimates = axes[name]["transfer_function"], axes[name]["estimates"]
        assert (function["input_unit"], function["output_unit"]) == ("N m", "rad/s")
        assert estimates["gain"]["value"] == pytest.approx(gain, rel=0.02) and function["delay"] == pytest.approx(0.5 / RATE, rel=0.02)
    named = cli("diagnose", tmp_path / "bag", *said, "--axis", "left", "--json").json["axes"]["left"]
    assert named["verdict"] == "nothing_missing"
    table = tmp_path / "table.csv"
    table.write_text("t,u,y\n0,1,2\n1,2,3\n", encoding="utf-8")
    assert "--velocity" in refused("fit", table, "--velocity")


def live_of(bag: Path, topics: Topics) -> tuple[FloatArray, FloatArray]:
    """Numbers and positions of the axis left as a replay feeds them."""
    blocks = [block for kind, block in stream_blocks(bag, topics) if kind == "position"]
    column = blocks[0].axes.index("left")
    return np.concatenate([block.seq for block in blocks]), np.concatenate([block.values[:, column] for block in blocks])


@pytest.mark.parametrize("voltage", [False, True])
def test_a_replay_integrates_as_loading_does(tmp_path: Path, voltage: bool) -> None:
    """Effort of the joint states or a command as blocks: steps of the replayed position are those of the loaded one, gaps or not."""
    kept = np.delete(np.arange(4000), np.arange(1001, 1019))
    wheel_bag(tmp_path / "bag", None, kept, voltage)
    loaded = load(tmp_path / "bag", effort_as_voltage=not voltage)
    seq, place = live_of(tmp_path / "bag", Topics(effort_as_voltage=not voltage))
    assert len(loaded.runs()) == 2 and len(seq) >= 3900
    both, one, other = np.intersect1d(seq, loaded.seq, return_indices=True)
    steps, expected = np.diff(place[one]), np.diff(loaded.position[other, loaded.axes.index("left")])
    np.testing.assert_allclose(steps, expected, atol=1e-6 * float(np.std(expected)) + 1e-3 * np.abs(expected).max())
    assert len(both) >= 3900


def test_replay_takes_the_live_parameters_or_the_option(tmp_path: Path) -> None:
    """output: velocity in the live file, or --velocity, gives the same answer in rad, although the unit of the velocity is given as rad/s."""
    wheel_bag(tmp_path / "bag", 0.25)
    common: dict[str, Any] = {"length": 256, "band_high": 60.0, "input_unit": "N m", "output_unit": "rad/s"}
    hears = {"source": "joint_state", "joint_topic": "/joint_states", "effort_as_voltage": True, "output": "velocity"}
    parameters = tmp_path / "live.yaml"
    parameters.write_text(yaml.safe_dump({"/xy/identifier": {"ros__parameters": {**hears, **common}}}))
    told = cli("replay", tmp_path / "bag", "--params", parameters, "--json").json
    assert told["units"] == {"input": "N m", "output": "rad"} and set(told["axes"]) == {"left", "right"}
    assert any("is a velocity: it is integrated" in note for note in told["notes"])
    pairs = [word for name, value in common.items() for word in ("--set", f"{name}={value}")]
    said = cli("replay", tmp_path / "bag", "--effort", "--velocity", *pairs, "--json").json
    assert said["axes"] == told["axes"]
