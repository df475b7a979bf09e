"""Uncertainty of a fit: Jacobian, covariance, intervals, expected cost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.fitting_cases import LINES, RATE, held, paper_machine, response_of

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, Structure, identify
from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

MACHINE = Structure(2, 4, 1)
RUNS = 60


def with_parameters(fit: Fit, values: dict[str, float]) -> TransferFunction:
    """The fitted function with some of its parameters replaced."""
    numerator, denominator = fit.tf.numerator.copy(), fit.tf.denominator.copy()
    for name, value in values.items():
        kind, _, power = name.partition("_")
        if kind != "delay":
            (numerator if kind == "numerator" else denominator)[-1 - int(power)] = value
    return TransferFunction(numerator, denominator, values.get("delay", fit.tf.delay))


def test_the_jacobian_is_the_derivative_of_the_prediction() -> None:
    """Analytic columns agree with central differences of the exact response, aliases and delay included, to 1e-6."""
    fit = identify(held(paper_machine(), 0.01), MACHINE)
    half = fit.frequency.size
    for column, name in enumerate(fit.parameters):
        value = fit.interval(name).value
        step = 1e-5 * abs(value)
        up, down = (held_response(with_parameters(fit, {name: value + sign * step}), fit.frequency, RATE) for sign in (1, -1))
        expected = fit.weight * (up - down) / (2 * step)
        found = fit.jacobian[:half, column] + 1j * fit.jacobian[half:, column]
        assert np.max(np.abs(found - expected)) < 1e-6 * np.max(np.abs(expected)), name


def correlated_noise(seed: int, neighbour: float) -> FrequencyResponse:
    """One per cent of error, with this correlation between neighbouring lines."""
    true = held_response(paper_machine(), LINES, RATE)
    rng = np.random.default_rng(seed)
    raw = (rng.normal(size=LINES.size + 1) + 1j * rng.normal(size=LINES.size + 1)) / np.sqrt(2.0)
    mix = 0.5 * (np.sqrt(1 + 2 * neighbour) + np.sqrt(1 - 2 * neighbour))  # mix^2 + rest^2 = 1, mix rest = neighbour
    noise = mix * raw[1:] + np.sqrt(1 - mix**2) * raw[:-1]
    sigma = 0.01 * np.abs(true)
    return replace(response_of(true + sigma * noise), sigma=sigma, line_correlation=np.array([1.0, neighbour]))


@pytest.mark.parametrize("neighbour", [0.0, 0.44])
def test_intervals_cover_the_truth_as_often_as_they_say(neighbour: float) -> None:
    """95 % intervals hold the truth in about 95 % of the runs, whether or not neighbouring lines share their errors."""
    truth = {
        "delay": 1.29e-3, "gain": 0.097, "pole_1": -246.0, "resonance_1.frequency": 47.0, "resonance_1.damping": 0.02,
        "antiresonance_1.frequency": 45.0, "antiresonance_1.damping": 0.03,
        "denominator_3": float(paper_machine().denominator[1]), "numerator_2": float(paper_machine().numerator[0]),
    }  # fmt: skip
    start, inside, scores = paper_machine(), 0, []
    for seed in range(RUNS):
        fit = identify(correlated_noise(seed, neighbour), MACHINE, start)
        for name, value in truth.items():
            item = fit.interval(name)
            inside += int(item.low <= value <= item.high)
            scores.append((item.value - value) / item.sigma)
    assert 0.90 < inside / (RUNS * len(truth)) < 0.985
    assert float(np.std(scores)) == pytest.approx(1.0, abs=0.12)


def test_neighbouring_errors_widen_the_intervals() -> None:
    """Correlated data carry less information: about sqrt(1 + 2 * 0.44) in a smooth parameter."""
    seen = correlated_noise(0, 0.44)
    known = identify(seen, MACHINE).interval("delay").sigma
    ignored = identify(replace(seen, line_correlation=np.ones(1)), MACHINE).interval("delay").sigma
    assert known / ignored == pytest.approx(np.sqrt(1.88), rel=0.05)


def test_the_cost_is_judged_against_what_noise_explains() -> None:
    """Consistent for the right orders; not without the resonance, and the fit says so."""
    seen = held(paper_machine(), 0.01, seed=5)
    good, poor = identify(seen, MACHINE), identify(seen, Structure(0, 2, 1))
    assert good.consistent
    assert abs(good.cost - good.expected_cost) < 3 * good.cost_deviation
    assert poor.consistent is False
    assert any("above" in warning for warning in poor.warnings)


def test_relative_error_carries_the_paper_s_names() -> None:
    """error_cost is the relative error in per cent, confidence is 100 minus it."""
    fit = identify(held(paper_machine(), 0.01, seed=6), MACHINE)
    expected = np.sqrt(np.mean(np.abs((fit.measured - fit.response) / fit.measured) ** 2))
    assert fit.relative_error == pytest.approx(expected)
    assert fit.error_cost == pytest.approx(100 * expected)
    assert fit.confidence == pytest.approx(100 - 100 * expected)


def test_only_trusted_lines_are_fitted() -> None:
    """A line that is not trusted has no influence, however wrong it is."""
    seen = held(paper_machine(), 0.01, seed=7)
    trusted = seen.trusted.copy()
    trusted[100:110] = False
    spoiled = seen.response.copy()
    spoiled[100:110] *= 1e3
    fit = identify(replace(seen, response=spoiled, trusted=trusted), MACHINE)
    assert fit.frequency.size == LINES.size - 10
    assert fit.tf.delay == pytest.approx(1.29e-3, abs=2e-6)


def test_too_few_lines_are_a_wrong_call() -> None:
    """The text gives the number, the required one, and the next action."""
    seen = held(paper_machine(), 0.01)
    few = replace(seen, trusted=np.arange(LINES.size) < 3)
    with pytest.raises(BadInput, match=r"number of trusted lines is 3; allowed: more than 3 for 7 parameters\. Record longer"):
        identify(few, MACHINE)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"numerator_order": 5, "denominator_order": 4}, "numerator order is 5"),
        ({"denominator_order": 13}, "denominator order is 13"),
        ({"integrators": 3}, "number of integrators is 3"),
        ({"delay": -1e-3}, "delay is -0.001 s"),
        ({"delay_max": -1.0}, "largest delay is -1.0 s"),
    ],
)
def test_structures_that_make_no_sense_are_wrong_calls(settings: dict[str, Any], text: str) -> None:
    """Orders and delays outside their range give an error with the allowed range."""
    with pytest.raises(BadInput, match=text):
        Structure(**settings)


def test_a_fit_that_fails_is_a_result() -> None:
    """Pure noise: no exception, finite or flagged, and never called consistent with a machine that fits well."""
    rng = np.random.default_rng(8)
    noise = rng.normal(size=LINES.size) + 1j * rng.normal(size=LINES.size)
    fit = identify(replace(response_of(noise), sigma=np.full(LINES.size, 1e-3)), MACHINE)
    assert fit.consistent is False
    assert fit.relative_error > 0.3
    assert fit.reason


def test_an_unknown_estimate_is_a_wrong_call() -> None:
    """The error lists the existing names."""
    with pytest.raises(BadInput, match="estimate is 'resonance_7'"):
        identify(held(paper_machine(), 0.01), MACHINE).interval("resonance_7")


def test_a_delay_at_its_limit_is_told() -> None:
    """If the true delay is larger than allowed, a warning suggests a larger limit."""
    fit = identify(held(paper_machine(), 0.01), replace(MACHINE, delay_max=1.2e-3))
    assert fit.tf.delay == pytest.approx(1.2e-3)
    assert any("largest allowed" in warning for warning in fit.warnings)
