"""Sub-steps of a simulation are as long as the residual error allows."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from xy_sysid.axis.model import FINE, AxisModel, simulate
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import sub_steps
from xy_sysid.greybox.parameters import problem
from xy_sysid.samples.block import FloatArray

RATE = 500.0
RUBBED = AxisModel(0.1, 1.3e-3, 30.0).with_effect("stribeck_friction", (0.3, 0.2, 5e-3))


def driven(noise: float, model: AxisModel = RUBBED) -> AxisData:
    """40 s of a machine that the model describes, with this encoder noise, m."""
    rng = np.random.default_rng(3)
    u: FloatArray = np.repeat(rng.normal(0.0, 1.0, 1000), 20)
    x = np.concatenate(([0.0], np.cumsum(simulate(model, RATE, u, np.zeros_like(u))) / RATE))
    return prepare(RATE, u, x + noise * rng.standard_normal(u.size))


def steps(data: AxisData, model: AxisModel, early: bool, finest: float) -> float:
    """Hz."""
    return sub_steps(data, problem(data, model, early), finest)


def test_a_law_that_bends_takes_short_steps_where_it_is_all_that_moves_the_axis() -> None:
    assert steps(driven(1e-9), RUBBED, True, FINE) > RATE


def test_a_noisy_reading_takes_longer_ones() -> None:
    rates = [steps(driven(noise), RUBBED, True, FINE) for noise in (1e-9, 1e-6, 1e-4)]
    assert rates == sorted(rates, reverse=True)
    assert rates[-1] == RATE


@pytest.mark.parametrize("early", [True, False])
def test_a_model_that_leaves_much_takes_one_step_a_sample(early: bool) -> None:
    """The error of its law is larger than that of sub-steps of a sample."""
    assert steps(driven(1e-9), AxisModel(0.05, 1.3e-3, 30.0).with_effect("stribeck_friction", (0.3, 0.2, 5e-3)), early, FINE) == RATE


def test_friction_whose_stops_are_found_exactly_takes_one_step_a_sample() -> None:
    model = AxisModel(0.1, 1.3e-3, 30.0).with_effect("coulomb_friction", (0.3,))
    assert steps(driven(1e-9, model), model, True, FINE) == RATE


def test_steps_are_never_shorter_than_what_is_asked_for() -> None:
    assert steps(driven(1e-9), RUBBED, True, 800.0) == 800.0
    assert steps(driven(1e-9), RUBBED, True, 200.0) == 200.0


def test_a_model_that_runs_away_ends_the_question_without_a_warning() -> None:
    """Negative drag that diverges: its power overflows, without a warning."""
    away = AxisModel(0.1, 1.3e-3, 30.0).with_effect("asymmetric_viscous_friction", (-1.5,))
    data = driven(1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert steps(data, away, True, FINE) == RATE
    assert np.max(np.abs(simulate(away, RATE, data.voltage, data.position))) > 1e160  # its square overflows
