"""More verdicts on a fit: unphysical models, delays at a bound, roots that cancel, and a model on other data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.fitting_cases import LINES, RATE, function, held, paper_machine, response_of

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, Structure, identify
from xy_sysid.fitting.check_on_data import check
from xy_sysid.fitting.verdicts import Verdict, simulation_sentence, validate
from xy_sysid.linear.simulate import SimulationError, held_response, simulate, simulation_error
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import told


@pytest.fixture(scope="module")
def good() -> Fit:
    """The paper's machine, fitted."""
    return identify(held(paper_machine(), 0.005, seed=1), Structure())


def verdict(fit: Fit, name: str) -> Verdict:
    """One verdict on a fit."""
    found = validate(fit, held(paper_machine(), 0.005, seed=1), orders=False)
    return next(item for item in found.verdicts if item.name == name)


def test_negative_coefficients_are_no_physical_axis(good: Fit) -> None:
    """As in the printed denominators of the paper: a negative mass, damping or stiffness, and an unstable pole."""
    assert verdict(good, "feasible").ok
    printed = replace(good, tf=replace(good.tf, denominator=good.tf.denominator * np.array([1.0, -1.0, 1.0, 1.0, 1.0])))
    feasible = verdict(printed, "feasible")
    assert not feasible.ok and "negative coefficient" in feasible.sentence
    stable = verdict(printed, "stable")
    assert not stable.ok and "artefact of the fit" in stable.sentence and stable.figures["unstable_poles"] > 0


def test_a_cost_far_below_noise_is_told(good: Fit) -> None:
    """Dependent lines make a fit look better than it is; a few lines are not sufficient."""
    assert verdict(good, "cost").ok
    low = verdict(replace(good, cost=0.1 * good.expected_cost), "cost")
    assert not low.ok and "not independent" in low.sentence
    assert verdict(replace(good, cost=0.1, expected_cost=5.0), "cost").ok
    assert "cannot be judged" in verdict(replace(good, expected_cost=-1.0), "cost").sentence


def test_a_gain_of_nothing_or_of_the_other_sign_is_told(good: Fit) -> None:
    """A gain of zero is not an axis; a negative gain is a matter of wiring, and physical."""
    none = verdict(replace(good, tf=replace(good.tf, numerator=np.array([1.0, 0.0]))), "feasible")
    assert not none.ok and "gain is not finite or zero" in none.sentence
    turned = verdict(replace(good, tf=replace(good.tf, numerator=-good.tf.numerator)), "feasible")
    assert turned.ok and "wired against each other" in turned.sentence


def test_damping_that_is_surely_negative_is_told(good: Fit) -> None:
    """Only an interval fully below zero counts; one that contains zero does not."""
    item = good.interval("resonance_1.damping")
    for high, ok in ((-0.01, False), (0.01, True)):
        changed = replace(item, value=-0.02, low=-0.03, high=high)
        fit = replace(good, intervals=tuple(changed if one.name == item.name else one for one in good.intervals))
        assert verdict(fit, "feasible").ok is ok


def test_a_pole_on_a_zero_is_told(good: Fit) -> None:
    """Nearly the same root above and below: a lower order does the same; the function's own pair does not count."""
    assert verdict(good, "cancellation").ok
    tf = replace(good.tf, numerator=np.convolve(good.tf.numerator, [1.0, 400.0]), denominator=np.convolve(good.tf.denominator, [1.0, 401.0]))
    cancelled = verdict(replace(good, tf=tf), "cancellation")
    assert not cancelled.ok and "-401" in cancelled.sentence and "lower order" in cancelled.sentence


def test_a_delay_at_a_bound_is_no_estimate(good: Fit) -> None:
    """At the largest delay, and at zero; in the z domain delays are integer samples, and the verdict does not apply."""
    assert verdict(good, "delay").ok
    late = identify(held(paper_machine(5e-3), 0.005), replace(Structure(), delay_max=2e-3))
    assert not verdict(late, "delay").ok and "may be larger" in verdict(late, "delay").sentence
    true = function([1.0, 2000.0], [1.0, 300.0, 0.0])
    early = identify(response_of(held_response(true, LINES, RATE) * np.exp(2e-4j * np.pi * LINES), 1e-3), Structure(0, 2, 1))
    assert early.tf.delay == 0.0 and not verdict(early, "delay").ok and "hold=none" in verdict(early, "delay").sentence
    fixed = identify(held(paper_machine(0.0), 0.005), replace(Structure(), delay=0.0))
    assert "delay" not in [item.name for item in validate(fixed, held(paper_machine(0.0), 0.005), orders=False).verdicts]


def test_an_unstable_model_runs_away_without_a_warning(good: Fit) -> None:
    """The figure says so, and no warning is printed."""
    u = np.random.default_rng(1).normal(size=20_000)
    y = simulate(paper_machine(), RATE, u)
    wild = replace(good, tf=function([1.0], [1.0, -400.0]))
    with np.errstate(all="raise"):
        found = validate(wild, held(paper_machine(), 0.005), (u, y, RATE), orders=False)
    simulation = next(item for item in found.verdicts if item.name == "simulation")
    assert not simulation.ok and "diverges" in simulation.sentence


def test_a_simulation_is_told_in_mm() -> None:
    """Lengths are small; other units stay."""
    assert "rms error 1.5 mm/s." in simulation_sentence(SimulationError(1.5e-3, 97.0, "m/s", "velocity", 10.0))
    assert "rms error 2 mm." in simulation_sentence(SimulationError(2e-3, 97.0, "m", "output", 10.0))
    assert "97.0 % of the output explained, rms error 0.002 rad." in simulation_sentence(SimulationError(2e-3, 97.0, "rad", "output", 10.0))


@pytest.fixture(scope="module")
def samples() -> tuple[FloatArray, FloatArray]:
    """10 s of the paper's machine under noise."""
    u = np.random.default_rng(3).normal(size=20_000)
    return u, simulate(paper_machine(), RATE, u)


def test_a_right_model_holds_on_new_data_and_a_wrong_one_is_off_where_it_is_wrong(samples: tuple[FloatArray, FloatArray]) -> None:
    """At the noise floor; another resonance: worst near it; another gain: its relative error, everywhere."""
    seen = held(paper_machine(), 0.01, seed=5)
    same = check(paper_machine(), seen, *samples)
    assert same.rms_sigma < 1.3 and "the model holds" in same.sentence and same.relative_error == pytest.approx(same.noise_floor, rel=0.2)
    assert same.simulation is not None and same.simulation.nrmse > 99.9
    pole = 2 * np.pi * 47.0
    moved = np.convolve([1.0, 246.0, 0.0], [1.0, 2 * 0.02 * pole * 0.9, (0.9 * pole) ** 2])
    other = check(replace(paper_machine(), denominator=moved), seen, *samples)
    assert other.rms_sigma > 5 and 40 < other.worst_hz < 49 and "off by" in other.sentence
    half = check(replace(paper_machine(), numerator=0.5 * paper_machine().numerator), seen, *samples)
    assert half.relative_error == pytest.approx(0.5, abs=0.01)


def test_a_model_is_compared_with_its_own_hold(samples: tuple[FloatArray, FloatArray]) -> None:
    """A model fitted to a band-limited input is compared without a hold."""
    seen = response_of(paper_machine().response(LINES), 0.01, seed=6)
    assert check(paper_machine(), seen, *samples, "none").rms_sigma < 1.3
    assert check(paper_machine(), seen, *samples, "zoh").rms_sigma > 5


def test_what_cannot_be_compared_is_refused(samples: tuple[FloatArray, FloatArray]) -> None:
    """Other units, another sampling time, no trusted line, an overflow; too short a signal only loses its check in time."""
    seen, tf = held(paper_machine(), 0.01), paper_machine()
    for wrong, frf, words in (
        (replace(tf, input_unit="A"), seen, r"m/A; allowed: m/V"),
        (replace(tf, sampling_time=1e-3, delay=0.0), seen, r"0\.001 s; allowed: 0\.0005 s"),
        (tf, replace(seen, trusted=np.zeros(len(seen), dtype=np.bool_)), "trusted lines is 0"),
        (TransferFunction(np.array([1e308, -1e308, 1e308]), np.array([1.0, 1.0, 1.0])), seen, "not finite"),
    ):
        with pytest.raises(BadInput, match=words):
            check(wrong, frf, *samples)
    assert check(tf, seen, samples[0][:100], samples[1][:100]).simulation is None


def test_no_number_beyond_reason_is_told() -> None:
    """A model that diverges to a thousand times the motion gets no per cent; sigma and factors end at a million."""
    u = np.random.default_rng(1).normal(size=4000)
    away = simulation_error(function([1.0], [1.0, -8.0]), 1000.0, u, 1e-3 * np.cumsum(u))
    assert away.nrmse == -np.inf and simulation_sentence(away).endswith("the simulation diverges, or the model has another scale.")
    assert (told(3.14159), told(2.32e12), told(-3e14), told(np.nan)) == ("3.14", "over 1e+06", "below -1e+06", "-")
