"""Every estimator recovers the machine without noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from helpers.fitting_cases import function
from helpers.fitting_cases import held as noisy
from helpers.fitting_data import RATE, held, lines, measured, paper_machine
from helpers.sampled import discrete

from xy_sysid.fitting import ESTIMATORS, FitOptions, Structure, identify
from xy_sysid.fitting.result import Fit
from xy_sysid.linear.transfer_function import TransferFunction

GAUSS_NEWTON = FitOptions(method="gauss_newton")
METHODS = [("iwls", FitOptions()), ("nlls", FitOptions()), ("nlls", GAUSS_NEWTON), ("ml", FitOptions())]
CONTINUOUS = {
    "integrator, delay": (paper_machine(), Structure()),
    "integrator, delay known": (paper_machine(), Structure(delay=1.29e-3)),
    "integrator": (paper_machine(0.0), Structure(delay=0.0)),
    "delay": (TransferFunction(np.array([3.0, 400.0]), np.array([1.0, 60.0, 9e4]), 2.3e-3), Structure(1, 2, 0)),
    "neither": (TransferFunction(np.array([3.0, 400.0]), np.array([1.0, 60.0, 9e4])), Structure(1, 2, 0, delay=0.0)),
    "two integrators": (TransferFunction(np.array([5e3]), np.array([1.0, 150.0, 0.0, 0.0]), 0.8e-3), Structure(0, 3, 2)),
}
DISCRETE = {
    "integrator, delay": (discrete(replace(paper_machine(), delay=3 / RATE), RATE), Structure(3, 4, 1, domain="z")),
    "neither": (discrete(TransferFunction(np.array([3.0, 400.0]), np.array([1.0, 60.0, 9e4])), RATE), Structure(1, 2, 0, delay=0.0, domain="z")),
}


def worst(fit: Fit) -> float:
    return float(np.max(np.abs(fit.response / fit.measured - 1.0)))


def away(found: TransferFunction, true: TransferFunction) -> float:
    """Largest relative error of a pole that is not an integrator."""
    a, b = (np.sort_complex(np.array([p for p in tf.poles() if p not in (0.0, 1.0)])) for tf in (found, true))
    return float(np.max(np.abs(a - b) / np.abs(b)))


@pytest.mark.parametrize("case", CONTINUOUS)
@pytest.mark.parametrize(("name", "options"), METHODS, ids=lambda value: value if isinstance(value, str) else value.method)
def test_a_continuous_machine_is_found_again(name: str, options: FitOptions, case: str) -> None:
    """Behind a hold, with and without integrators and delay."""
    true, structure = CONTINUOUS[case]
    fit = ESTIMATORS[name](held(true), replace(structure, weighting="relative"), options=options)
    assert fit.converged
    assert worst(fit) < 1e-6
    assert away(fit.tf, true) < 1e-4
    assert fit.tf.delay == pytest.approx(true.delay, abs=1e-6)
    assert fit.tf.gain == pytest.approx(true.gain, rel=1e-5)
    assert fit.tf.integrators == structure.integrators


@pytest.mark.parametrize("case", DISCRETE)
@pytest.mark.parametrize(("name", "options"), [("lls", FitOptions()), *METHODS], ids=lambda value: value if isinstance(value, str) else value.method)
def test_a_discrete_machine_is_found_again(name: str, options: FitOptions, case: str) -> None:
    """In z the delay is an integer number of samples, and every estimator is exact, including LLS."""
    true, structure = DISCRETE[case]
    frequency = lines(1800)
    fit = ESTIMATORS[name](measured(frequency, true.response(frequency)), structure, options=options)
    assert worst(fit) < 1e-6
    assert away(fit.tf, true) < 1e-6
    assert fit.tf.sampling_time == pytest.approx(1 / RATE)
    assert fit.tf.delay == pytest.approx(true.delay, abs=1e-12)


@pytest.mark.parametrize("method", ["gauss_newton", "levenberg_marquardt"])
def test_the_papers_path_finds_what_has_no_delay(method: Literal["levenberg_marquardt", "gauss_newton"]) -> None:
    """nllsfdi models powers of s alone: without delay and hold it is exact."""
    true = TransferFunction(np.array([2.0, 50.0, 1e5]), np.array([1.0, 300.0, 1.2e5, 1e7]))
    frf = measured(lines(), true.response(lines()))
    fit = ESTIMATORS["nllsfdi"](frf, Structure(2, 3, 0), options=FitOptions(method=method))
    assert fit.converged
    assert worst(fit) < 1e-6
    assert away(fit.tf, true) < 1e-5


@pytest.mark.parametrize("case", CONTINUOUS)
def test_linear_least_squares_is_exact_between_band_limited_signals(case: str) -> None:
    """Levy's equations have no hold; with a given delay they are exact."""
    true, structure = CONTINUOUS[case]
    fit = ESTIMATORS["lls"](measured(lines(), true.response(lines())), replace(structure, delay=true.delay, hold="none", weighting="relative"))
    assert worst(fit) < 1e-6


@pytest.mark.parametrize("case", ["delay", "two integrators"])
def test_linear_least_squares_searches_for_a_free_delay(case: str) -> None:
    """At low orders the search finds it (at higher ones the bias of the method hides it)."""
    true, structure = CONTINUOUS[case]
    fit = ESTIMATORS["lls"](measured(lines(), true.response(lines())), replace(structure, hold="none", weighting="relative"))
    assert fit.tf.delay == pytest.approx(true.delay, abs=1e-9)
    assert worst(fit) < 1e-6


def test_the_delay_of_the_papers_machine_is_found_within_a_microsecond() -> None:
    """1.29 ms behind a hold at 2 kHz, from a cold start."""
    fit = identify(held(paper_machine()), Structure())
    assert fit.tf.delay == pytest.approx(1.29e-3, abs=1e-9)
    assert fit.interval("resonance_1.frequency").value == pytest.approx(47.56, abs=1e-5)
    assert fit.interval("antiresonance_1.frequency").value == pytest.approx(46.2, abs=1e-5)
    assert fit.interval("pole_1").value == pytest.approx(-246.0, rel=1e-5)
    assert fit.interval("gain").value == pytest.approx(0.097, rel=1e-6)


def test_order_twelve_is_recovered() -> None:
    """Six pairs from 8 to 280 Hz, delay and hold: response to 1e-6, poles to 1e-4."""
    frequencies, dampings = np.geomspace(8.0, 280.0, 6), np.linspace(0.02, 0.06, 6)
    parts = [np.array([1.0, 2 * z * 2 * np.pi * f, (2 * np.pi * f) ** 2]) for f, z in zip(frequencies, dampings, strict=True)]
    denominator, numerator = np.ones(1), np.ones(1)
    for part in parts:
        denominator = np.convolve(denominator, part)
    for f in np.sqrt(frequencies[1:] * frequencies[:-1]):
        numerator = np.convolve(numerator, [1.0, 2 * 0.03 * 2 * np.pi * f, (2 * np.pi * f) ** 2])
    true = TransferFunction(numerator * 1e4, denominator, 0.7e-3)
    fit = identify(held(true), Structure(10, 12, 0, delay_max=2e-3))
    assert worst(fit) < 1e-6
    assert away(fit.tf, true) < 1e-4
    assert fit.tf.delay == pytest.approx(0.7e-3, abs=1e-7)


def test_a_warm_start_ends_where_a_cold_one_does() -> None:
    """From the last model of a slightly changed machine: the same minimum, in fewer steps."""
    old, new = paper_machine(1.25e-3), held(paper_machine())
    warm, cold = identify(new, Structure(), old), identify(new, Structure())
    assert warm.start == "the last model"
    assert warm.iterations <= 8
    assert warm.tf.delay == pytest.approx(cold.tf.delay, abs=1e-10)


@pytest.mark.parametrize("integrators", [0, 1])
@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 1.29e-3])
@pytest.mark.parametrize("noise", [1e-4, 1e-2, 5e-2])
def test_a_fast_pole_is_not_left_on_the_wrong_side(integrators: int, delay: float, noise: float) -> None:
    """A fast pole and one mirrored to the right half plane with a longer delay look similar: a cold start ends at the better one."""
    true = function([3e6], np.polymul(np.poly([-1000.0, -3000.0]), [1.0, *[0.0] * integrators]), delay)
    frf, structure = noisy(true, noise), Structure(0, 2 + integrators, integrators)
    cold, warm = identify(frf, structure), identify(frf, structure, true, doubt=False)
    assert cold.cost == pytest.approx(warm.cost, rel=1e-3)
    assert np.all(cold.poles.real <= 0.0)
