"""First run: small steps, each checked before the next; wrong wiring is found at the first motion, a right machine is measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from campaigns.faults.encoder_faults import settings
from xy_sim.machine import Machine
from xy_sysid.excitation.first_run import FirstRun, Push, PushResult
from xy_sysid.samples.block import FloatArray


def push(machine: Machine, what: Push, axes: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Rest, forth, rest, back, rest, with the edges of a change of the offset: linear over one block."""
    shape = np.concatenate([np.zeros(200), np.ones(300), np.zeros(200), -np.ones(300), np.zeros(200)])
    shape = np.convolve(shape, np.ones(20) / 20)[: shape.size]
    voltage = np.zeros((shape.size, len(axes)))
    voltage[:, axes.index(what.axis)] = what.volts * shape
    return voltage, machine.step(voltage)


def first_run(machine: Machine, wrong: Any = lambda position: position, **axis: Any) -> tuple[FirstRun, list[PushResult]]:
    """The full first run; wrong: effect of the wiring on the positions."""
    run, answers = FirstRun(settings({"rms": 1.0, **axis})), []
    while (what := run.next()) is not None:
        voltage, position = push(machine, what, run.axes)
        answers.append(run.took(voltage, wrong(position)))
    return run, answers


def test_it_grows_in_small_steps_and_finds_gain_lag_and_friction() -> None:
    """On the rigid table: every step at most 1.6 times the previous one, gain within 3 %, delay and lag within 1 ms, one sentence each."""
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
    """Below breakaway it says 'at rest' and continues; then the friction is found within 15 %."""
    run, answers = first_run(Machine.from_file("rigid.yaml").with_parts({"coulomb_friction": 0.4}))
    assert run.problem == "" and "at rest" in answers[0].sentence
    found = run.found("x")
    assert found.friction == pytest.approx(0.4, rel=0.15) and found.still < 0.4 < (found.moves or 0) < 0.7
    assert found.velocity_gain == pytest.approx(0.097, rel=0.1)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda position: -position, "plus volts move it to minus, and minus volts to plus: swap the motor's wires"),
        (lambda position: 1000 * position, "is the position in m?"),
        (lambda position: position[:, ::-1], "cables or columns are swapped"),
        (lambda position: np.vstack((np.tile(position[:1], (240, 1)), position[:-240])), "it answers after 1"),
        (lambda position: position * np.nan, "did not arrive completely"),
    ],
    ids=["sign", "unit", "swapped", "late", "not a number"],
)
def test_what_is_wired_wrong_ends_it_at_the_first_motion(wrong: Any, words: str) -> None:
    """Sign, unit, swapped axes: found at the first step with motion, after less than a millimetre, and no larger step follows."""
    machine = Machine.from_file("rigid.yaml")
    run, answers = first_run(machine, wrong)
    assert words in run.problem and run.next() is None
    assert len(answers) == 1 and abs(machine.state("x")["motor"]) < 1e-3


def test_a_position_in_kilometres_is_noticed() -> None:
    """1000 times too small: the axis seems to need minutes for its travel; the run ends with a question about the unit."""
    run, _ = first_run(Machine.from_file("rigid.yaml", clean=True), lambda position: position / 1000)
    assert "is the position in m?" in run.problem


def test_no_push_goes_further_than_half_of_the_free_travel() -> None:
    """A short axis: the large steps are left out."""
    run, answers = first_run(Machine.from_file("rigid.yaml"), travel_min=-0.02, travel_max=0.02, brake=0.005, rms=5.0)
    assert run.problem == "" and max(abs(answer.moved[0]) for answer in answers) < 0.015
    assert max(answer.push.volts for answer in answers) < 2.0


def test_an_axis_that_never_moves_is_named() -> None:
    """No motion up to twice rms: a sentence with the next action, and no numbers."""
    run, _ = first_run(Machine.from_file("rigid.yaml").with_parts({"coulomb_friction": 8.0}))
    assert run.problem == "" and run.found("x").velocity_gain is None and "did not move up to 2 V: raise rms" in run.summary("x")


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("load", [0.3, -0.3])
def test_a_load_that_falls_is_no_fault_of_the_wires(load: float, sign: float) -> None:
    """It moves at 0 V, before any step: a load drives it, and the answer does not suggest to swap wires, for either wiring."""
    run, answers = first_run(Machine.from_file("rigid.yaml").with_parts({"constant_load": load}), lambda position: sign * position)
    assert len(answers) == 1 and "at 0 V, before any push: a load drives it" in run.problem and "swap" not in run.problem


def pushed(law: Any, lag: float = 0.1, gain: float = 0.1) -> FirstRun:
    """The first run of an axis with speed' = (gain voltage - speed) / lag + law(place, speed, voltage, time)."""
    run = FirstRun(settings({"rms": 1.0}, axes=("x",)))
    shape = np.convolve(np.concatenate([np.zeros(200), np.ones(300), np.zeros(200), -np.ones(300), np.zeros(200)]), np.ones(20) / 20)[:1200]
    while (what := run.next()) is not None:
        random, place, speed, seen = np.random.default_rng(1), 0.0, 0.0, np.empty(len(shape))
        for row, volts in enumerate(what.volts * shape):
            seen[row] = np.round((place + 2e-7 * random.standard_normal()) / 5e-7) * 5e-7
            speed += ((gain * volts - speed) / lag + law(place, speed, volts, row / 2000)) / 2000
            place += speed / 2000
        run.took((what.volts * shape)[:, None], seen[:, None])
    return run


def test_a_load_that_tips_over_is_no_fault_of_the_wires() -> None:
    """In balance until the first step, then it moves on in that direction in spite of the next step."""
    run = pushed(lambda place, speed, volts, time: 1500.0 * place)
    assert "a load drives it (it hangs or tips over)" in run.problem and "swap" not in run.problem


def test_a_brake_that_opens_with_the_voltage_leaves_both_causes_open() -> None:
    """It falls only during the step forth: both causes are named, with a test that distinguishes them."""
    run = pushed(lambda place, speed, volts, time: -20.0 * (0.1 < time < 0.25) - (volts + 1e3 * speed) * (time > 0.25))
    assert "to minus at plus volts, and not the other way" in run.problem
    assert "push it by hand" in run.problem and "load" in run.problem and "swap the motor's wires" in run.problem


@pytest.mark.parametrize(("gain", "lag"), [(0.1, 0.005), (0.5, 0.5), (5.0, 5.0)])
def test_an_axis_that_coasts_is_seen_the_right_way(gain: float, lag: float) -> None:
    """Slow poles and free masses move on after a step: wires are blamed only if the sign is wrong."""
    assert "swap" not in pushed(lambda *_: 0.0, lag, gain).problem and "load drives" not in pushed(lambda *_: 0.0, lag, gain).problem
    assert "swap the motor's wires" in pushed(lambda *_: 0.0, lag, -gain).problem


def test_a_sticky_axis_that_gives_and_comes_back_is_not_asked_for_its_unit() -> None:
    """A sticking contact moves by micrometres and springs back: it counts as held, and larger steps follow."""
    run = pushed(lambda place, speed, volts, time: -4e4 * place, lag=0.01)
    assert run.problem == "" and run.found("x").velocity_gain is None


def test_an_axis_that_moves_too_little_is_asked_for_both_causes() -> None:
    """It hardly moves and stays there: its unit or friction, with a test that distinguishes them."""
    run, _ = first_run(Machine.from_file("rigid.yaml", clean=True), lambda position: position / 1000)
    assert "is the position in m?" in run.problem and "by hand" in run.problem and "friction" in run.problem


@pytest.mark.parametrize("moved", [(0.0, -1e-3), (-5e-7, -1e-3)])
def test_a_push_that_moves_it_only_back_is_no_division_by_zero(moved: tuple[float, float]) -> None:
    """As a resting axis with a load or asymmetric friction does: a sentence says so, and the next step follows."""
    run = FirstRun(settings({"rms": 1.0}, axes=("x",)))
    what = run.next()
    assert what is not None
    shape = np.concatenate([np.zeros(200), np.ones(300), np.zeros(200), -np.ones(300), np.zeros(200)])
    flicker = 5e-7 * (np.arange(1200) % 3 == 0)
    place = np.cumsum(moved[0] * (shape > 0) / 300 + moved[1] * (shape < 0) / 300) + flicker
    told = run.took((what.volts * shape)[:, None], place[:, None])
    assert told.problem == "" and "not forth" in told.sentence and run.next() is not None
