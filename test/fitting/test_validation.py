"""The verdicts on a fit: each passes for a good fit, and fails with a sentence for a bad one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.fitting_cases import LINES, RATE, function, held, paper_machine, response_of

from xy_sysid.fitting import ESTIMATORS, Structure, identify
from xy_sysid.fitting.verdicts import Validation, Verdict, validate
from xy_sysid.linear.simulate import held_response, simulate

MACHINE = Structure(2, 4, 1)


def verdict(result: Validation, name: str) -> Verdict:
    """The one of that name."""
    return next(item for item in result.verdicts if item.name == name)


@pytest.fixture(scope="module")
def good() -> Validation:
    """The paper's machine, fitted with its own orders."""
    seen = held(paper_machine(), 0.01, seed=1)
    return validate(identify(seen, MACHINE), seen)


def test_a_right_model_passes_every_check(good: Validation) -> None:
    """Cost, residual, identifiability, stability, band, cancellation, feasibility and orders."""
    assert [item.name for item in good.verdicts if not item.ok] == []
    assert good.ok


def test_the_pade_form_comes_with_it(good: Validation) -> None:
    """Fourth order, without delay."""
    assert good.pade4.delay == 0.0
    assert good.pade4.denominator.size == 9


def test_the_right_orders_are_suggested() -> None:
    """MDL prefers the machine's own orders to fewer, and says by how much."""
    seen = held(paper_machine(), 0.01, seed=2)
    result = validate(identify(seen, Structure(0, 2, 1)), seen)
    order = verdict(result, "order")
    assert not order.ok
    assert (order.figures["numerator_order"], order.figures["denominator_order"]) == (2, 4)


def test_a_missing_resonance_shows_in_cost_and_residual() -> None:
    """The sentences say that an effect is missing, and where the error is largest: at the pair."""
    seen = held(paper_machine(), 0.01, seed=3)
    result = validate(identify(seen, Structure(0, 2, 1)), seen, orders=False)
    assert not verdict(result, "cost").ok
    residual = verdict(result, "residual")
    assert not residual.ok
    assert 43.0 < residual.figures["worst_hz"] < 49.0


def test_an_unidentifiable_combination_is_named() -> None:
    """Two poles and zeros too many: the sentence names the parameters that are only determined together."""
    seen = held(paper_machine(), 0.003, seed=1)
    result = validate(identify(seen, Structure(4, 6, 1)), seen, orders=False)
    found = verdict(result, "identifiable")
    assert not found.ok
    assert "numerator_" in found.sentence
    assert "denominator_" in found.sentence


def test_poles_far_above_the_band_are_told() -> None:
    """Poles at 1.6 and 4.8 kHz act as a delay on data up to 300 Hz: the sentence gives their frequency."""
    true = function([3e8], np.polymul([1.0, 1e4], [1.0, 3e4]), 1e-3)
    seen = held(true, 0.001, seed=5)
    inside = verdict(validate(identify(seen, Structure(0, 2, 0)), seen, orders=False), "inside_band")
    assert not inside.ok
    assert "Hz" in inside.sentence


def test_the_paper_s_path_is_told_to_be_unphysical() -> None:
    """A delay squeezed into four poles: not consistent, and not a physical axis near its band."""
    seen = held(paper_machine(), 0.005, seed=6)
    result = validate(ESTIMATORS["nllsfdi"](seen, MACHINE), seen, orders=False)
    assert not result.ok
    assert not verdict(result, "cost").ok


def test_an_unstable_pole_is_told() -> None:
    """A response that only a pole in the right half plane explains gives a stable=False verdict with its frequency."""
    true = function(np.array([100.0]), np.array([1.0, -50.0]))
    seen = response_of(true.response(LINES), 0.001)
    result = validate(identify(seen, Structure(0, 1, 0, delay=0.0, hold="none")), seen, orders=False)
    stable = verdict(result, "stable")
    assert not stable.ok
    assert "50" in stable.sentence


def test_simulation_on_unseen_data_is_part_of_the_verdict() -> None:
    """It holds on data of the same machine, and not on those of a machine with half the gain."""
    seen = response_of(held_response(paper_machine(), LINES, RATE), 0.01, seed=7)
    fit = identify(seen, MACHINE)
    u = np.random.default_rng(9).normal(size=20_000)
    y = simulate(paper_machine(), RATE, u)
    same = validate(fit, seen, (u, y, RATE), orders=False)
    assert verdict(same, "simulation").ok
    assert same.simulation is not None
    assert same.simulation.nrmse > 98.0
    other = validate(fit, seen, (u, 0.5 * y, RATE), orders=False)
    assert not verdict(other, "simulation").ok


def test_without_a_sigma_nothing_is_claimed_about_noise() -> None:
    """A response without uncertainty can be fitted, but its cost cannot be judged."""
    seen = replace(held(paper_machine(), 0.01), sigma=np.full(LINES.size, np.nan))
    fit = identify(seen, replace(MACHINE, weighting="relative"))
    assert fit.consistent is None
    assert fit.tf.delay == pytest.approx(1.29e-3, abs=5e-6)


def test_nothing_is_ok_that_too_few_numbers_tell() -> None:
    """Four lines, seven parameters: one verdict says so with the numbers, and no other is ok."""
    seen = held(paper_machine(), 0.01, seed=1)
    few = replace(seen.select(slice(80, 112, 8)), line_correlation=np.array([1.0, 0.4]))
    result = validate(identify(few, MACHINE), few, orders=False)
    assert result.verdicts[0].name == "data" and "independent numbers for 7 parameters" in result.verdicts[0].sentence
    assert not any(item.ok for item in result.verdicts)
    assert not result.trustworthy


def test_intervals_carry_the_misfit(good: Validation) -> None:
    """Unchanged if noise explains the cost; otherwise widened by the root of cost over expected cost, and not trustworthy."""
    seen = held(paper_machine(), 0.01, seed=1)
    right, wrong = identify(seen, MACHINE), identify(seen, Structure(0, 2, 1))
    assert good.trustworthy and right.misfit == 1.0 and right.intervals_with_misfit == right.intervals
    assert wrong.misfit == pytest.approx(np.sqrt(wrong.cost / wrong.expected_cost)) and wrong.misfit > 2.0
    for item, wide in zip(wrong.intervals, wrong.intervals_with_misfit, strict=True):
        assert wide.high - wide.low == pytest.approx(wrong.misfit * (item.high - item.low))
    assert not validate(wrong, seen, orders=False).trustworthy


def test_a_pole_that_runs_away_leaves_the_expected_cost_as_it_is() -> None:
    """A surplus pole moves outside the band of the data: the expected cost remains that of the number of lines."""
    seen = held(function([20.0], [1.0, 240.0, 0.0], 1e-3), 0.01, seed=2)
    found = identify(seen, Structure(0, 3, 1))
    assert found.expected_cost == pytest.approx(len(seen) / 2, rel=0.05)
    assert 0.5 < found.cost / found.expected_cost < 1.5
