"""Every estimator finds the machine that made a clean response; the paper's path does not, as it knows no delay."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from fitting_cases import LINES, RATE, blurred, function, held, paper_machine, response_of

from xy_sysid.fitting import ESTIMATORS, FitOptions, Structure, identify
from xy_sysid.fitting.structure import Weighting
from xy_sysid.simulation import discrete
from xy_sysid.transfer_function import held_response

EXACT = ["iwls", "nlls", "ml"]
MACHINE = Structure(2, 4, 1)
Method = Literal["gauss_newton", "levenberg_marquardt"]


@pytest.mark.parametrize("name", EXACT)
def test_estimators_recover_the_paper_s_machine(name: str) -> None:
    """Delay within 1 us, 47 Hz pair, velocity gain and pole, through hold and aliases."""
    fit = ESTIMATORS[name](held(paper_machine()), replace(MACHINE, weighting="relative" if name != "ml" else "sigma"))
    assert fit.tf.delay == pytest.approx(1.29e-3, abs=1e-9)
    assert fit.tf.gain == pytest.approx(0.097, rel=1e-6)
    assert fit.interval("resonance_1.frequency").value == pytest.approx(47.0, abs=1e-5)
    assert fit.interval("antiresonance_1.frequency").value == pytest.approx(45.0, abs=1e-5)
    assert fit.interval("pole_1").value == pytest.approx(-246.0, rel=1e-6)
    assert fit.relative_error < 1e-6


@pytest.mark.parametrize("method", ["gauss_newton", "levenberg_marquardt"])
@pytest.mark.parametrize("weighting", ["relative", "uniform", "sigma"])
def test_both_descents_and_all_weightings_reach_the_truth(method: Method, weighting: Weighting) -> None:
    """Gauss-Newton and Levenberg-Marquardt converge on clean data under each weighting."""
    options = FitOptions(method=method)
    fit = ESTIMATORS["nlls"](held(paper_machine()), replace(MACHINE, weighting=weighting), None, options)
    assert fit.converged, fit.reason
    assert fit.relative_error < 1e-6


@pytest.mark.parametrize("name", ["lls", *EXACT])
@pytest.mark.parametrize("integrators", [0, 1])
def test_a_band_limited_input_without_delay_is_recovered_by_all(name: str, integrators: int) -> None:
    """Without hold, window and delay the linear fit is exact too."""
    denominator = np.array([1.0, 60.0, 2e5, *[0.0] * integrators])
    true = function(np.array([3.0, 2e4]), denominator)
    structure = Structure(1, denominator.size - 1, integrators, delay=0.0, hold="none", weighting="relative")
    fit = ESTIMATORS[name](response_of(true.response(LINES)), structure)
    assert np.allclose(fit.tf.numerator, true.numerator, rtol=1e-6)
    assert np.allclose(fit.tf.denominator, true.denominator, rtol=1e-6)


@pytest.mark.parametrize("name", EXACT)
def test_a_discrete_model_is_recovered_with_its_whole_samples_of_delay(name: str) -> None:
    """In the z domain the delay is a whole number of samples, found by trial."""
    true = replace(discrete(function(np.array([3e4]), np.array([1.0, 100.0, 3e4])), RATE), delay=3 / RATE)
    structure = Structure(1, 2, 0, domain="z", weighting="relative" if name != "ml" else "sigma")
    fit = ESTIMATORS[name](response_of(true.response(LINES)), structure)
    assert fit.tf.sampling_time == 1 / RATE
    assert round(fit.tf.delay * RATE) == 3
    assert np.allclose(np.sort_complex(fit.tf.poles()), np.sort_complex(true.poles()), atol=1e-7)


def test_the_window_s_blur_is_part_of_the_model() -> None:
    """A response smeared over several lines gives the machine back, not a machine with more damping."""
    offsets = np.arange(-6, 7) * 0.5 * RATE / 4096
    weights = np.exp(-0.5 * (offsets / (RATE / 4096)) ** 2)
    seen = blurred(paper_machine(), offsets, weights / weights.sum())
    fit = identify(seen, MACHINE)
    assert fit.relative_error < 1e-6
    assert fit.interval("resonance_1.damping").value == pytest.approx(0.02, rel=1e-3)
    sharp = identify(replace(seen, kernel_offset=np.zeros(1), kernel_weight=np.ones(1)), MACHINE)
    assert sharp.interval("resonance_1.damping").value > 0.0202


@pytest.mark.parametrize("spread", ["log", "linear"])
def test_twelve_poles_are_recovered(spread: str) -> None:
    """Order 12 over 1 to 300 Hz: response to 1e-6, poles to 1e-4."""
    modes = np.geomspace(1.5, 280.0, 6) if spread == "log" else np.linspace(20.0, 280.0, 6)
    dips = np.sqrt(modes[1:] * modes[:-1])
    poles, zeros = (2 * np.pi * np.concatenate((f * (-0.03 + 1j), f * (-0.03 - 1j))) for f in (modes, dips))
    true = function(np.real(np.poly(zeros)), np.real(np.poly(poles)), 1.3e-3)
    fit = identify(held(true), Structure(10, 12, 0))
    assert fit.relative_error < 1e-6
    found = np.array([fit.poles[np.argmin(np.abs(fit.poles - pole))] for pole in poles])
    assert np.max(np.abs(found / poles - 1)) < 1e-4
    assert np.max(np.abs(held_response(fit.tf, LINES, RATE) / held_response(true, LINES, RATE) - 1)) < 1e-6


def test_a_warm_start_ends_where_a_cold_one_does() -> None:
    """The last model as a start gives the same minimum in fewer steps."""
    first = identify(held(paper_machine(), 0.01, seed=1), MACHINE)
    new = held(paper_machine(), 0.01, seed=2)
    warm, cold = identify(new, MACHINE, first.tf), identify(new, MACHINE)
    assert warm.start == "the last model"
    assert warm.cost == pytest.approx(cold.cost, rel=1e-8)
    assert warm.tf.delay == pytest.approx(cold.tf.delay, abs=1e-10)


def test_a_bad_warm_start_does_not_lead_astray() -> None:
    """From a wrong model the answer is no worse than from none."""
    new = held(paper_machine(), 0.01, seed=3)
    wrong = function(np.array([1.0, 1.0, 1.0]), np.array([1.0, 10.0, 1e5, 1e6, 0.0]), 9e-3)
    assert identify(new, MACHINE, wrong).cost <= identify(new, MACHINE).cost * (1 + 1e-6)


def test_the_paper_s_path_absorbs_the_delay_and_shows_it() -> None:
    """Its linear start leaves about 40 %, its descent tens of per cent, where the model with delay leaves none."""
    seen = held(paper_machine(), 0.005)
    start = ESTIMATORS["nllsfdi"](seen, MACHINE, None, FitOptions(max_iterations=0))
    end = ESTIMATORS["nllsfdi"](seen, MACHINE)
    assert 20.0 < start.error_cost < 60.0
    assert 8.0 < end.error_cost < 30.0
    assert end.confidence == pytest.approx(100.0 - end.error_cost)
    assert end.tf.delay == 0.0
    assert identify(seen, MACHINE).error_cost < 0.6


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_paper_s_path_is_exact_where_its_model_is(order: int) -> None:
    """Without delay, hold and integrator nllsfdi's steps end at the truth."""
    numerator = np.array([5e3, 1e7, 1e9])[-order - 1 :]
    true = function(numerator, np.polymul([1.0, 40.0, 9e4], [1.0, 300.0, 4e5]))
    fit = ESTIMATORS["nllsfdi"](response_of(true.response(LINES)), Structure(order, 4, 0))
    assert fit.relative_error < 1e-8
