"""One score: how well an error is explained by the encoder's noise and by what the model does not have."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import FINER, FIRST_LOOK, LONG, NEARER, finish, fit, fit_base
from xy_sysid.greybox.least_squares import Schedule, Target, solve
from xy_sysid.greybox.objective import Objective, responder
from xy_sysid.greybox.parameters import problem

FLOOR = np.full(30, 1e-8)
LINES = np.full(30, 20.0)
RESPONSE = 1e-2 / (1.0 + (np.arange(30.0) / 5.0) ** 2)


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis with Coulomb friction."""
    return prepare(2000.0, *recorded("coulomb_friction", seconds=20.0).axis("x"))


@pytest.mark.parametrize(("force", "motion"), [(1e-3, 0.0), (0.0, 1e-6), (1e-3, 1e-6), (1e-4, 1e-7)])
def test_the_powers_that_made_an_error_are_found(force: float, motion: float) -> None:
    """From the error's power by band, whichever of the two made it."""
    objective = Objective(FLOOR, LINES)
    power = FLOOR + force * RESPONSE + motion
    found = objective.spectrum(power, RESPONSE)
    assert found == pytest.approx(power, rel=0.05)


def test_an_error_that_is_the_floor_scores_nothing() -> None:
    """Nothing is unmodelled, and the score is 0; twice the floor is worse."""
    objective = Objective(FLOOR, LINES)
    assert objective.of_power(FLOOR, RESPONSE) == pytest.approx(0.0, abs=1e-4)
    assert objective.of_power(2.0 * FLOOR, RESPONSE) == pytest.approx(np.log(2.0), rel=0.02)


def test_a_model_that_runs_away_has_the_worst_score() -> None:
    """Infinite, and no error."""
    objective = Objective(FLOOR, LINES)
    assert objective.of_power(np.full(30, np.inf), RESPONSE) == np.inf


def test_a_scaled_axis_scores_the_same() -> None:
    """In millimetres as in metres: the objective knows no unit."""
    one, other = Objective(FLOOR, LINES), Objective(1e6 * FLOOR, LINES)
    power = FLOOR + 1e-3 * RESPONSE
    assert other.of_power(1e6 * power, 1e6 * RESPONSE) == pytest.approx(one.of_power(power, RESPONSE), rel=1e-6)


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
        run, values, scale = problem(data, model, True, 2000.0)
        target = Target(data.begun(data.velocity), data.brief, data.floor, responder(data.layout, model))
        _, before = target.spectrum(target.measured - target.windows.spectrum(run(values)), values)
        assert solve(run, target, scale, values, schedule).score <= before


def test_a_round_that_goes_too_far_is_shortened() -> None:
    """Where most of the force is unmodelled, the weights hold for a short way only: a fit goes that way instead of ending where it began."""
    draws, rate = np.random.default_rng(1), 500.0
    voltage, other = draws.normal(size=10_000), 5.0 * draws.normal(size=10_000)
    velocity = simulate(AxisModel(0.1, 0.0, 5.0), rate, voltage + other, np.zeros(voltage.size))
    known = prepare(rate, voltage, np.round(np.concatenate(([0.0], np.cumsum(velocity))) / rate, 6))
    model = AxisModel(0.03, 0.0, 1.0)
    run, values, scale = problem(known, model, True, 2000.0)
    target = Target(known.begun(known.velocity), known.brief, known.floor, responder(known.layout, model))
    _, before = target.spectrum(target.measured - target.windows.spectrum(run(values)), values)
    found = solve(run, target, scale, values, NEARER)
    assert found.score < before - 0.03
    assert found.values[0] * found.values[2] == pytest.approx(0.5, rel=0.2)


def test_a_fit_stays_at_the_answer(data: AxisData) -> None:
    """Begun where it ended it goes nowhere else."""
    base = fit_base(data)
    once = fit(data, base.model.with_effect("coulomb_friction", (0.2,)))
    again = finish(data, once.model)
    assert again.held_out_error == pytest.approx(once.held_out_error, rel=1e-3)
    assert again.excess <= once.excess + 1e-3
