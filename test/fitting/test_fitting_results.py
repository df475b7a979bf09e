"""The report of a fit: its uncertainty, failures, and invalid calls."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.fitting_data import held, lines, measured, paper_machine

from campaigns.bench.intervals import machine, trials, truths
from xy_sysid.errors import BadInput
from xy_sysid.fitting import ESTIMATORS, Structure, identify
from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.modes import pole_estimates
from xy_sysid.fitting.problem import from_transfer_function, problem
from xy_sysid.fitting.result import Ended
from xy_sysid.fitting.structure import Weighting
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

SIMPLE = TransferFunction(np.array([300.0]), np.array([1.0, 120.0, 0.0]), 1.7e-3)
RIGID = Structure(0, 2, 1)


def noisy(seed: int, sigma: float = 0.01) -> FrequencyResponse:
    frf = held(SIMPLE, lines(300), sigma)
    random = np.random.default_rng(seed)
    error = (random.standard_normal(300) + 1j * random.standard_normal(300)) / np.sqrt(2)
    return replace(frf, response=frf.response + frf.sigma * error, averages=1e6)


@pytest.mark.parametrize(("name", "weighting"), [("ml", "sigma"), ("nlls", "relative"), ("nlls", "uniform")])
def test_the_covariance_is_the_scatter_of_many_fits(name: str, weighting: Weighting) -> None:
    """150 draws of independent noise: spread over stated sigma within 15 %, no bias, for every weighting."""
    fits = [ESTIMATORS[name](noisy(seed), replace(RIGID, weighting=weighting), SIMPLE) for seed in range(150)]
    for item in fits[0].intervals:
        values = np.array([fit.interval(item.name).value for fit in fits])
        sigma = np.median([fit.interval(item.name).sigma for fit in fits])
        exact = {"delay": 1.7e-3, "gain": 2.5, "numerator_0": 300.0, "denominator_1": 120.0, "pole_1": -120.0}[item.name]
        assert np.std(values) / sigma == pytest.approx(1.0, abs=0.17)
        assert abs(np.mean(values) - exact) < 4.0 * sigma / np.sqrt(150) + 0.15 * sigma
    assert np.mean([fit.cost for fit in fits]) == pytest.approx(fits[0].expected_cost, abs=4.0 * fits[0].cost_deviation / np.sqrt(150))


def test_intervals_hold_the_truth_in_simulated_recordings() -> None:
    """25 recordings of 30 s through hold, window and estimate: about 95 of 100 intervals hold (``python -m campaigns.bench coverage``: 400)."""
    found, fits = trials(25, 30.0, 2e-6)
    exact = truths(machine(), fits[0])
    inside = [item.low <= exact[name] <= item.high for name, items in found.items() for item in items]
    assert 0.88 < np.mean(inside) <= 1.0
    for name in ("antiresonance_1.frequency", "resonance_1.frequency", "delay", "gain"):
        values = np.array([item.value for item in found[name]])
        assert 0.55 < np.std(values) / np.median([item.sigma for item in found[name]]) < 1.6


def test_neighbouring_lines_that_err_together_widen_the_intervals() -> None:
    """Correlated errors count as fewer lines."""
    frf = noisy(1)
    alone = identify(frf, RIGID).interval("delay").sigma
    together = identify(replace(frf, line_correlation=np.array([1.0, 0.45, 0.04])), RIGID).interval("delay").sigma
    assert together / alone == pytest.approx(np.sqrt(1 + 2 * 0.49), rel=0.1)
    holes = replace(frf, line_correlation=np.array([1.0, 0.45, 0.04])).select(np.arange(300) % 3 == 0)
    assert identify(holes, RIGID).interval("delay").sigma / alone == pytest.approx(np.sqrt(3.0), rel=0.15)


def test_the_cost_tells_a_model_that_misses_something() -> None:
    """A rigid model on a machine with a resonance: the cost is far above that of noise, and a warning says so."""
    fit = identify(held(paper_machine(), sigma=1e-3), Structure(0, 2, 1))
    assert fit.converged
    assert fit.consistent is False
    assert any("misses something" in warning for warning in fit.warnings)
    assert identify(noisy(2), RIGID).consistent is True


def test_the_poles_alone_are_those_of_the_whole_fit() -> None:
    """The fast path for the watch on a resonance gives the same numbers as a fit from the same start."""
    frf, start = noisy(3), replace(SIMPLE, delay=1.6e-3)
    short, whole = pole_estimates(frf, RIGID, start), identify(frf, RIGID, start, doubt=False)
    assert [item.name for item in short] == ["pole_1"]
    assert short[0] == whole.interval("pole_1")
    assert pole_estimates(frf, RIGID, paper_machine()) == ()


def test_a_fit_that_fails_is_a_result() -> None:
    """Noise without a machine: no exception, a large error, and a reason. Numbers out of range: not converged, all NaN."""
    random = np.random.default_rng(0)
    chaos = measured(lines(50), random.standard_normal(50) + 1j * random.standard_normal(50), 0.01)
    for name, estimator in ESTIMATORS.items():
        fit = estimator(chaos, Structure(weighting="relative"))
        assert fit.relative_error > 0.1, name
        assert fit.reason.endswith("."), name
    task = problem(noisy(1), RIGID)
    point = from_transfer_function(task, SIMPLE)
    assert point is not None
    overflow = finish(task, replace(point, b=point.b * np.nan), "ml", Ended(3, True, "Stopped."), "nowhere")
    assert not overflow.converged
    assert overflow.reason == "Stopped. The numbers ran out of range."
    assert overflow.relative_error == float("inf") and overflow.intervals == ()


def test_a_delay_at_its_limit_is_said() -> None:
    """The largest tested delay was too small."""
    fit = identify(held(SIMPLE), replace(RIGID, delay_max=1e-3))
    assert fit.tf.delay == pytest.approx(1e-3)
    assert any("largest allowed" in warning for warning in fit.warnings)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"denominator_order": 13}, "denominator order is 13; allowed: 1 to 12"),
        ({"denominator_order": 0}, "denominator order is 0"),
        ({"numerator_order": 5}, "numerator order is 5; allowed: 0 to the denominator's, 4"),
        ({"integrators": 3}, "number of integrators is 3"),
        ({"delay": -1e-3}, "delay is -0.001 s"),
        ({"delay_max": -1.0}, "largest delay"),
    ],
)
def test_orders_that_make_no_sense_are_refused(values: dict[str, Any], says: str) -> None:
    """One line: the value, the allowed range, the next action."""
    with pytest.raises(BadInput) as caught:
        Structure(**values)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_lines_that_cannot_carry_the_parameters_are_refused() -> None:
    """Too few lines, none trusted, no sigma although it is the weight, a fractional delay in z."""
    frf = held(paper_machine())
    with pytest.raises(BadInput, match="number of trusted lines is 3"):
        identify(frf.select(slice(0, 3)), Structure())
    with pytest.raises(BadInput, match="number of trusted lines is 0"):
        identify(replace(frf, trusted=np.zeros(len(frf), dtype=bool)), Structure())
    with pytest.raises(BadInput, match="magnitude of the response"):
        identify(replace(frf, response=frf.response * 1e200), Structure())
    with pytest.raises(BadInput, match="sigma"):
        identify(replace(frf, sigma=np.full(len(frf), np.nan)), Structure())
    with pytest.raises(BadInput, match="whole number of samples"):
        identify(frf, Structure(domain="z", delay=1.29e-3))
    without = ESTIMATORS["nlls"](replace(frf, sigma=np.full(len(frf), np.nan)), Structure(weighting="relative"))
    assert without.converged and without.consistent is None
    assert not np.isfinite(without.interval("delay").sigma)


def test_lines_that_are_not_numbers_are_left_out() -> None:
    """NaN, infinite, zero: not used, even if ``trusted``."""
    frf = held(paper_machine())
    response = frf.response.copy()
    response[[5, 9, 30]] = [np.nan, np.inf, 0.0]
    fit = identify(replace(frf, response=response), Structure())
    assert len(fit.frequency) == 610
    assert fit.tf.delay == pytest.approx(1.29e-3, abs=1e-9)


def test_an_unknown_estimate_names_those_there_are() -> None:
    """The nearest spelling for typing errors."""
    with pytest.raises(BadInput, match="delay, gain, pole_1"):
        identify(noisy(1), RIGID).interval("dealy")


def test_the_jacobian_belongs_to_the_reported_parameters() -> None:
    """A step in the reported coefficients moves the weighted prediction as the Jacobian says."""
    fit = identify(noisy(5), RIGID)
    assert fit.parameters == ("numerator_0", "denominator_1", "delay")
    step = np.array([1e-3, 3e-4, 1e-9])
    moved = TransferFunction(fit.tf.numerator + step[0], fit.tf.denominator + np.array([0, step[1], 0]), fit.tf.delay + step[2])
    change = (held(moved, fit.frequency).response - held(fit.tf, fit.frequency).response) * fit.weight
    assert np.allclose(fit.jacobian @ step, np.concatenate((change.real, change.imag)), rtol=1e-3, atol=1e-4 * np.max(np.abs(change)))
