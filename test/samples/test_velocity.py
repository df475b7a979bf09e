"""Velocities of joint states: the fields of a message, and their integration to a position."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from xy_sysid.imports.motion import as_position
from xy_sysid.live.diagnoser import Diagnoser
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.integral import FAR, Path, integral
from xy_sysid.samples.joint_fields import JointOutput, JointReader
from xy_sysid.samples.joint_states import JointCounter
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import DiagnoserSettings, IdentifierSettings

NAN = float("nan")


@dataclass
class Message:
    """A message as filled by a driver."""

    name: list[str] = field(default_factory=lambda: ["right", "left"])
    position: list[float] = field(default_factory=list)
    velocity: list[float] = field(default_factory=list)
    effort: list[float] = field(default_factory=list)


def reader(output: JointOutput, effort: bool = False) -> JointReader:
    return JointReader({"x": "left", "y": "right"}, output, effort)


@pytest.mark.parametrize(
    ("output", "message", "words"),
    [
        ("position", Message(velocity=[1.0, 2.0]), "positions are empty; this driver gives velocity. Set output to velocity."),
        (
            "position",
            Message(position=[NAN, NAN], velocity=[1.0, 2.0]),
            "positions of left, right are NaN; this driver gives velocity. Set output to",
        ),
        (
            "position",
            Message(position=[0.5, NAN], velocity=[1.0, NAN]),
            "positions of right are NaN; expected one for each of left, right. The driver",
        ),
        ("velocity", Message(position=[1.0, 2.0]), "velocities are empty; this driver gives position. Set output to position."),
        ("velocity", Message(), "velocities are empty; expected one for each of left, right"),
        ("velocity", Message(velocity=[1.0]), "velocities are 1 for 2 joints"),
        (
            "velocity",
            Message(name=["wheel"], velocity=[1.0]),
            'joints wheel; expected left, right. Set the parameter joints, for example to ["x=NAME"].',
        ),
    ],
)
def test_a_message_without_the_field_says_which_one_there_is(output: JointOutput, message: Message, words: str) -> None:
    """The field, its problem, and the setting for the fields that the driver provides."""
    if words.startswith("positions of right"):
        message.name = ["left", "right"]
    told = reader(output).wrong(message)
    assert told.startswith("joint_states: ") and words in told


def test_efforts_that_are_not_there_are_told_apart_from_the_output() -> None:
    """The output is fine: the sentence is about the input."""
    told = reader("velocity", effort=True).wrong(Message(velocity=[1.0, 2.0]))
    assert told.startswith("joint_states: efforts are empty; this driver gives none. Set effort_as_voltage to false")


def test_a_row_has_the_joints_in_the_order_of_the_axes() -> None:
    """Output first, then effort, for any order in the message; a NaN is a fault of that sample, not of the driver."""
    one = reader("velocity", effort=True)
    message = Message(velocity=[1.0, 2.0], effort=[3.0, 4.0])
    assert one.wrong(message) == "" and one.row(message).tolist() == [2.0, 1.0, 4.0, 3.0]
    message.velocity[0] = NAN
    assert one.wrong(message) == "" and np.isnan(one.row(message)[1])


def moved(seq: FloatArray, velocity: FloatArray, period: float = 0.01, pieces: int = 1) -> FloatArray:
    """The result of a path that gets it in this many pieces."""
    path = Path(velocity.shape[1])
    parts = [path.add(one, values, period) for one, values in zip(np.array_split(seq, pieces), np.array_split(velocity, pieces), strict=True)]
    return np.concatenate(parts)


def test_live_and_of_a_file_a_velocity_becomes_the_same_position_in_pieces_of_any_length() -> None:
    """The rule of the importers, bit for bit; over a gap the velocity is held."""
    seq = np.r_[0.0:300.0, 340.0:800.0]
    velocity = np.random.default_rng(1).normal(size=(len(seq), 2))
    whole = integral(velocity, np.diff(seq) * 0.01)
    for pieces in (1, 7, len(seq)):
        np.testing.assert_array_equal(moved(seq, velocity, 0.01, pieces), whole)
    recording = Recording(
        100.0, ("x", "y"), seq.astype(np.int64), seq / 100, velocity, velocity, input_unit="N m", output_unit="rad/s", measured="velocity"
    )
    np.testing.assert_allclose(as_position(recording).position, whole, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("wrong", "lost"), [(NAN, 50), (np.inf, 50), (1e30, 51)])
def test_a_velocity_that_is_none_leaves_no_trace_in_what_follows(wrong: float, lost: int) -> None:
    """One sample has no position, and from the next one on every step is a measured velocity, to full precision."""
    seq, velocity = np.arange(200.0), np.random.default_rng(2).normal(size=(200, 2))
    damaged = velocity.copy()
    damaged[50, 1] = wrong
    for pieces in (1, 200):
        found = moved(seq, damaged, 0.01, pieces)
        assert np.flatnonzero(~np.isfinite(found).all(axis=1)).tolist() == [lost]
        np.testing.assert_allclose(np.diff(found[lost + 2 :], axis=0), 0.01 * velocity[lost + 2 : -1], atol=1e-13)


def test_a_gap_a_restart_and_an_endless_run_leave_the_steps_right() -> None:
    """Within each part every step is the measured one; a counter that goes back adds nothing; positions stay within double precision."""
    velocity = np.random.default_rng(3).normal(size=(400, 1))
    parts = (slice(0, 100), slice(100, 250), slice(250, 400))
    found = moved(np.r_[0.0:100.0, 5000.0:5150.0, 0.0:150.0], velocity)
    for part in parts:
        np.testing.assert_allclose(np.diff(found[part, 0]), 0.01 * velocity[part, 0][:-1], atol=1e-12)
    assert found[250, 0] == found[249, 0]
    far = moved(np.arange(5000.0), np.full((5000, 1), FAR / 10))
    assert np.nanmax(far) <= FAR and np.count_nonzero(np.isnan(far)) == 4 and np.nanmax(np.diff(far[:1000, 0])) == pytest.approx(FAR / 1000)


def drive(first: float) -> Block:
    """20 samples of voltage at 500 Hz."""
    seq = np.arange(first, first + 20.0)
    return Block(("x",), seq, 1.7e9 + seq / 500.0, np.zeros((20, 1)))


@pytest.mark.parametrize("with_voltage", [False, True])
def test_joint_states_of_velocities_are_counted_and_become_positions(with_voltage: bool) -> None:
    """Jittering stamps, lost samples, effort beside the velocity: each step between neighbours is the velocity times the true period."""
    random = np.random.default_rng(4)
    kept = np.delete(np.arange(4000), [700, 701, 2500])
    stamps = 1.7e9 + (kept + random.uniform(-0.1, 0.1, len(kept))) / 500.0
    velocity, effort = random.normal(size=(2, 4000))
    counter = JointCounter(("x",), with_voltage, "velocity")
    if with_voltage:
        counter.see_voltage(drive(0.0))
    blocks = []
    for number, time in zip(kept.tolist(), stamps.tolist(), strict=True):
        if with_voltage and number % 20 == 0:
            counter.see_voltage(drive(number + 20.0))
        block = counter.add(time, np.array([velocity[number], effort[number]]))
        blocks += [] if block is None else [block]
    seq, values = np.concatenate([block.seq for block in blocks]).astype(int), np.concatenate([block.values for block in blocks])
    assert seq.tolist() == kept[: len(seq)].tolist() and len(seq) > 3900
    near = np.flatnonzero(np.diff(seq) == 1)
    np.testing.assert_allclose(np.diff(values[:, 0])[near], velocity[seq[near]] / 500.0, rtol=0.01)
    np.testing.assert_array_equal(values[:, 1], effort[seq])


def test_the_unit_of_a_velocity_and_that_of_its_position_mean_the_same() -> None:
    """A unit of rad/s for a velocity gives answers in rad, like rad; for a position, rad/s is kept."""
    for said in ("rad", "rad/s"):
        assert IdentifierSettings(output="velocity", input_unit="N m", output_unit=said).units == ("N m", "rad")
        assert DiagnoserSettings(output="velocity", output_unit=said).units.speed == "rad/s"
    assert IdentifierSettings(output_unit="rad/s").units.output == "rad/s"
    diagnoser = Diagnoser(DiagnoserSettings(output="velocity", output_unit="rad/s", minimum=0.5), ("x",))
    for first in np.arange(0.0, 2000.0, 20.0):
        diagnoser.feed("voltage", drive(first))
        diagnoser.feed("position", drive(first))
    diagnoser.ask("begin")
    job = diagnoser.start()
    assert job is not None and job.run.units.output == "rad"
