"""Transfer functions in the time domain: exact at the samples, for any delay."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
from helpers.fitting_data import RATE, lines, paper_machine
from helpers.sampled import discrete

from xy_sysid.errors import BadInput
from xy_sysid.linear.simulate import held_response, simulate, simulation_error, state_space
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray

DELAYS = [0.0, 0.3e-3, 0.5e-3, 1.29e-3, 4.9999e-3]


@pytest.mark.parametrize("delay", DELAYS)
def test_a_step_of_the_first_order_is_the_textbooks(delay: float) -> None:
    """k (1 - exp(-(t - delay) / tau)) at every sample."""
    tf = TransferFunction(np.array([300.0]), np.array([1.0, 100.0]), delay)
    t = np.arange(200) / RATE
    expected = np.where(t > delay, 3.0 * (1.0 - np.exp(-100.0 * (t - delay))), 0.0)
    assert np.allclose(simulate(tf, RATE, np.ones(200)), expected, atol=1e-12)


def test_the_simulation_agrees_with_an_integrator_of_differential_equations() -> None:
    """The paper's machine on random held voltages, against scipy's Runge-Kutta at 1e-10."""
    tf = paper_machine()
    u = np.random.default_rng(1).standard_normal(40)
    a, b, c, _ = state_space(tf)
    switches = tf.delay + np.arange(40) / RATE
    edges = np.unique(np.concatenate((np.arange(41) / RATE, switches)))
    x, out = np.zeros(b.size), {0: 0.0}
    for begin, end in itertools.pairwise(edges):
        index = int(np.floor((0.5 * (begin + end) - tf.delay) * RATE))
        force = u[index] if 0 <= index < 40 else 0.0

        def slope(_: float, y: FloatArray, force: float = float(force)) -> FloatArray:
            return np.asarray(a @ y + b * force)

        step = scipy.integrate.solve_ivp(slope, (begin, end), x, rtol=1e-10, atol=1e-16)
        x = step.y[:, -1]
        if abs(end * RATE - round(end * RATE)) < 1e-9:
            out[round(end * RATE)] = float(c @ x)
    expected = np.array([out[n] for n in range(40)])
    assert np.max(np.abs(simulate(tf, RATE, u) - expected)) < 1e-7 * np.max(np.abs(expected))


@pytest.mark.parametrize("delay", DELAYS)
def test_the_discrete_form_is_exact(delay: float) -> None:
    """Its response is the held response, and its simulation that of the continuous function."""
    tf = replace(paper_machine(), delay=delay)
    sampled, frequency = discrete(tf, RATE), lines(900, 1.1)
    assert np.max(np.abs(sampled.response(frequency) / held_response(tf, frequency, RATE) - 1.0)) < 1e-6
    u = np.random.default_rng(2).standard_normal(3000)
    ours, theirs = simulate(sampled, RATE, u), simulate(tf, RATE, u)
    assert np.max(np.abs(ours - theirs)) < 1e-7 * np.max(np.abs(theirs))
    assert discrete(sampled, RATE) is sampled


def test_direct_feedthrough_is_seen_at_once() -> None:
    """Equal orders: the output jumps with the input, a fraction of a sample later with such a delay."""
    tf = TransferFunction(np.array([2.0, 0.0]), np.array([1.0, 50.0]))
    assert simulate(tf, RATE, np.array([1.0, 1.0]))[0] == 2.0
    assert simulate(replace(tf, delay=0.2e-3), RATE, np.array([1.0, 1.0]))[0] == 0.0


def test_the_simulation_error_is_zero_for_the_truth_and_large_for_another() -> None:
    """In velocity for an integrating model, for any start and drift of the position; per cent explained."""
    tf = paper_machine()
    u = np.random.default_rng(3).standard_normal(8000)
    y = simulate(tf, RATE, u) + 0.4
    good = simulation_error(tf, RATE, u - np.mean(u), y)
    assert (good.compared, good.unit) == ("velocity", "m/s")
    assert good.nrmse > 95.0  # the mean of the voltage was removed
    assert good.seconds == pytest.approx(3.5, abs=0.01)
    exact = simulation_error(tf, RATE, u - np.mean(u), simulate(tf, RATE, u - np.mean(u)))
    assert exact.nrmse > 99.999 and exact.rms < 1e-9
    half = simulation_error(replace(tf, numerator=0.5 * tf.numerator), RATE, u, y)
    assert half.nrmse == pytest.approx(50.0, abs=2.0)
    still = simulation_error(TransferFunction(np.ones(1), np.array([1.0, 9.0])), RATE, u, np.zeros(8000))
    assert still.compared == "output" and still.nrmse == float("-inf")


def test_what_cannot_be_simulated_is_said() -> None:
    """More zeros than poles, another rate, arrays that do not match, too few samples."""
    with pytest.raises(BadInput, match="numerator order is 2; allowed: at most the denominator's, 1"):
        simulate(TransferFunction(np.ones(3), np.ones(2)), RATE, np.ones(5))
    with pytest.raises(BadInput, match="sampling time of the model"):
        simulate(TransferFunction(np.ones(1), np.ones(2), 0.0, 0.01), RATE, np.ones(5))
    with pytest.raises(BadInput, match="shape of the output"):
        simulation_error(paper_machine(), RATE, np.ones(3000), np.ones(2999))
    with pytest.raises(BadInput, match="number of samples is 500"):
        simulation_error(paper_machine(), RATE, np.ones(500), np.ones(500))
