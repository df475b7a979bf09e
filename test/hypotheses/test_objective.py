"""The score: likelihood of an error from encoder noise and unmodelled causes."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.diagnosis.diagnose import diagnose_prepared
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import FINER, FIRST_LOOK, LONG, NEARER, finish, fit, fit_base
from xy_sysid.greybox.least_squares import Schedule, Target, solve
from xy_sysid.greybox.objective import Objective
from xy_sysid.greybox.parameters import problem
from xy_sysid.units import Units

FLOOR = np.full(30, 1e-8)
LINES = np.full(30, 20.0)
RESPONSE = 1e-2 / (1.0 + (np.arange(30.0) / 5.0) ** 2)


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis with Coulomb friction."""
    return prepare(2000.0, *recorded("coulomb_friction", seconds=20.0).axis("x"))


@pytest.mark.parametrize(("force", "motion"), [(1e-3, 0.0), (0.0, 1e-6), (1e-3, 1e-6), (1e-4, 1e-7)])
def test_the_powers_that_made_an_error_are_found(force: float, motion: float) -> None:
    """From the error's power by band, for either cause."""
    objective = Objective(FLOOR, LINES, RESPONSE)
    power = FLOOR + force * RESPONSE + motion
    found = objective.spectrum(power)
    assert found == pytest.approx(power, rel=0.05)


def test_an_error_that_is_the_floor_scores_nothing() -> None:
    """At the floor nothing is unmodelled, and the score is 0; twice the floor is worse."""
    objective = Objective(FLOOR, LINES, RESPONSE)
    assert objective.of_power(FLOOR) == pytest.approx(0.0, abs=1e-4)
    assert objective.of_power(2.0 * FLOOR) == pytest.approx(np.log(2.0), rel=0.02)


def test_a_model_that_runs_away_has_the_worst_score() -> None:
    """An infinite score, without an exception."""
    objective = Objective(FLOOR, LINES, RESPONSE)
    assert objective.of_power(np.full(30, np.inf)) == np.inf


def test_a_scaled_axis_scores_the_same() -> None:
    """The same in millimetres and in metres: the objective is independent of units."""
    one, other = Objective(FLOOR, LINES, RESPONSE), Objective(1e6 * FLOOR, LINES, 1e6 * RESPONSE)
    power = FLOOR + 1e-3 * RESPONSE
    assert other.of_power(1e6 * power) == pytest.approx(one.of_power(power), rel=1e-6)


def test_the_response_to_a_force_is_measured_where_the_motion_answers() -> None:
    """The response of a simulated axis in open loop: a gain and a pole."""
    rate, gain, pole = 2000.0, 0.1, 150.0
    voltage = np.random.default_rng(1).normal(size=40_000)
    velocity = simulate(AxisModel(gain, 0.0, pole), rate, voltage, np.zeros(voltage.size))
    known = prepare(rate, voltage, np.concatenate(([0.0], np.cumsum(velocity))) / rate)
    true = (gain * pole) ** 2 / ((2.0 * np.pi * known.layout.frequency) ** 2 + pole**2)
    banded = np.bincount(known.layout.band, true, known.layout.count) / known.layout.lines
    slow = known.layout.edges()[1:] < 300.0  # above, the hold is visible
    assert known.floor.response[slow] == pytest.approx(banded[slow], rel=0.1)


@pytest.fixture(scope="module")
def hanging() -> AxisData:
    """A hanging joint on a slow path: its current shows every reversal of the friction, its motion is smooth."""
    rate, draws = 100.0, np.random.default_rng(3)
    time = np.arange(0.0, 60.0, 1.0 / rate)
    position = np.sum([0.3 * np.sin(2 * np.pi * f * time + draws.uniform(0.0, 6.0)) for f in (0.1, 0.23, 0.41, 0.67)], axis=0)
    speed = np.gradient(position, time)
    current = 0.3 * np.gradient(speed, time) + speed + 3.5 * np.sin(position + 0.1) + 0.7 * np.sign(speed) + 0.02 * draws.normal(size=time.size)
    return prepare(rate, current, position + 2e-5 * draws.normal(size=time.size), units=Units("A", "rad"))


def test_the_response_to_a_force_is_that_of_a_rigid_axis_where_the_motion_is_silent(hanging: AxisData) -> None:
    """A controller keeps the motion smooth: output over input is nearly zero there, and is not the response to a force."""
    layout = hanging.layout
    force, moved = (hanging.fitted.spectrum(signal) for signal in (hanging.voltage[:-1], hanging.velocity))
    ratio = layout.power(moved) / layout.power(force)
    fast = (layout.edges()[:-1] > 3.5) & (layout.edges()[1:] < 6.0)
    inertia = (0.3 * 2.0 * np.pi * layout.edges()[:-1][fast]) ** -2
    assert np.all(ratio[fast] < 1e-2 * inertia)
    assert np.all((hanging.floor.response[fast] > inertia) & (hanging.floor.response[fast] < 10.0 * inertia))


def test_no_model_makes_its_own_error_cheap(hanging: AxisData) -> None:
    """A model that hardly moves is not better than one that follows the motion: the effects of the joint are found, with their sizes."""
    found = diagnose_prepared(hanging)
    assert set(found.effects) == {"gravity", "coulomb_friction"}
    assert found.final is not None
    assert found.final.parameter("gravity.amplitude").value == pytest.approx(3.5, rel=0.02)
    assert found.final.parameter("coulomb_friction.coulomb").value == pytest.approx(0.7, rel=0.02)


@pytest.mark.parametrize(
    "effects",
    [(), (("coulomb_friction", (0.05,)),), (("cogging", (0.1, 5e-3, 0.0)),), (("base_resonance", (0.1, 40.0, 0.05, 0.05)),)],
    ids=["rigid", "coulomb_friction", "cogging", "base_resonance"],
)
@pytest.mark.parametrize("schedule", [FIRST_LOOK, NEARER, FINER, LONG], ids=["first look", "nearer", "finer", "long"])
def test_a_fit_never_ends_worse_than_it_starts(data: AxisData, effects: tuple[tuple[str, tuple[float, ...]], ...], schedule: Schedule) -> None:
    """By the objective, from right and from wrong starts."""
    for gain, pole in ((0.1, 250.0), (0.02, 20.0)):
        model = AxisModel(gain, 1e-3, pole, effects)
        task = problem(data, model, True)
        run = task.at(2000.0)
        target = Target(data.first_stage(data.velocity), data.screening_windows, data.floor)
        _, before = target.spectrum(target.measured - target.windows.spectrum(run(task.row)))
        assert solve(run, target, task.scale, task.row, schedule).score <= before


def test_a_fit_stays_at_the_answer(data: AxisData) -> None:
    """Started at its result, it does not move."""
    base = fit_base(data)
    once = fit(data, base.model.with_effect("coulomb_friction", (0.2,)))
    again = finish(data, once.model)
    assert again.held_out_error == pytest.approx(once.held_out_error, rel=1e-3)
    assert again.excess <= once.excess + 1e-3
