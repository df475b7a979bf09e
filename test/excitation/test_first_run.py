"""First run: small pushes, each looked at before the next; what is wrong is found at the first motion, what is right is measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from faults.encoder_faults import settings
from xy_sim.machine import Machine
from xy_sysid.excitation.first_run import FirstRun, Push, PushResult
from xy_sysid.samples.block import FloatArray


def push(machine: Machine, what: Push, axes: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Rest, forth, rest, back, rest, with the edges that a change of the offset has: a line over one block."""
    shape = np.concatenate([np.zeros(200), np.ones(300), np.zeros(200), -np.ones(300), np.zeros(200)])
    shape = np.convolve(shape, np.ones(20) / 20)[: shape.size]
    voltage = np.zeros((shape.size, len(axes)))
    voltage[:, axes.index(what.axis)] = what.volts * shape
    return voltage, machine.step(voltage)


def first_run(machine: Machine, wrong: Any = lambda position: position, **axis: Any) -> tuple[FirstRun, list[PushResult]]:
    """The whole of it; wrong: what the wiring makes of the positions."""
    run, answers = FirstRun(settings({"rms": 1.0, **axis})), []
    while (what := run.next()) is not None:
        voltage, position = push(machine, what, run.axes)
        answers.append(run.took(voltage, wrong(position)))
    return run, answers


def test_it_grows_in_small_steps_and_finds_gain_lag_and_friction() -> None:
    """On the rigid table: every push at most 1.6 times the one before, gain within 3 %, delay and lag within 1 ms, one sentence each."""
    run, answers = first_run(Machine.from_file("rigid.yaml"))
    assert run.problem == "" and {answer.push.axis for answer in answers} == {"x", "y"}
    volts = np.array([answer.push.volts for answer in answers if answer.push.axis == "x"])
    assert volts[0] == pytest.approx(0.05) and (volts[1:] / volts[:-1] < 1.61).all() and volts[-1] == 2.0
    for axis, gain, lag in (("x", 0.097, 0.00129 + 1 / 246), ("y", 0.0965, 0.00138 + 1 / 244)):
        found = run.found(axis)
        assert found.velocity_gain == pytest.approx(gain, rel=0.03) and found.lag == pytest.approx(lag, abs=1e-3)
        assert found.friction is not None and found.friction < 0.01 and "write velocity_gain: 0.09" in run.summary(axis)
    assert all(answer.sentence for answer in answers)


def test_friction_is_told_from_a_fault_and_measured() -> None:
    """Below breakaway it says 'at rest' and goes on; then the friction is known within 15 %."""
    run, answers = first_run(Machine.from_file("rigid.yaml").with_parts({"coulomb_friction": 0.4}))
    assert run.problem == "" and "at rest" in answers[0].sentence
    found = run.found("x")
    assert found.friction == pytest.approx(0.4, rel=0.15) and found.still < 0.4 < (found.moves or 0) < 0.7
    assert found.velocity_gain == pytest.approx(0.097, rel=0.1)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda position: -position, "plus volts move it to minus"),
        (lambda position: 1000 * position, "is the position in m?"),
        (lambda position: position[:, ::-1], "cables or columns are swapped"),
        (lambda position: np.vstack((np.tile(position[:1], (240, 1)), position[:-240])), "it answers after 1"),
        (lambda position: position * np.nan, "did not arrive whole"),
    ],
    ids=["sign", "unit", "swapped", "late", "not a number"],
)
def test_what_is_wired_wrong_ends_it_at_the_first_motion(wrong: Any, words: str) -> None:
    """Sign, unit, swapped axes: found within the first push that moves, after less than a millimetre, and no louder push follows."""
    machine = Machine.from_file("rigid.yaml")
    run, answers = first_run(machine, wrong)
    assert words in run.problem and run.next() is None
    assert len(answers) == 1 and abs(machine.state("x")["motor"]) < 1e-3


def test_a_position_in_kilometres_is_noticed() -> None:
    """1000 times too small: the axis moves as if its travel took minutes; ended with the question for the unit."""
    run, _ = first_run(Machine.from_file("rigid.yaml", clean=True), lambda position: position / 1000)
    assert "is the position in m?" in run.problem


def test_no_push_goes_further_than_half_of_the_free_travel() -> None:
    """A short axis: the loud pushes are left out."""
    run, answers = first_run(Machine.from_file("rigid.yaml"), travel_min=-0.02, travel_max=0.02, brake=0.005, rms=5.0)
    assert run.problem == "" and max(abs(answer.moved[0]) for answer in answers) < 0.015
    assert max(answer.push.volts for answer in answers) < 2.0


def test_an_axis_that_never_moves_is_named() -> None:
    """Nothing moves up to twice rms: said, with what to do, and no number is made up."""
    run, _ = first_run(Machine.from_file("rigid.yaml").with_parts({"coulomb_friction": 8.0}))
    assert run.problem == "" and run.found("x").velocity_gain is None and "did not move up to 2 V: raise rms" in run.summary("x")
