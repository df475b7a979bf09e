"""Transfer functions: response, roots, verdicts, Pade form, and the exact response behind a hold."""

from __future__ import annotations

import numpy as np
import pytest
from fitting_cases import DENSE, LINES, RATE, function, paper_machine, state_space_response

from xy_sysid.errors import BadInput
from xy_sysid.reduction import balanced_truncation, minreal
from xy_sysid.simulation import discrete, simulate, simulation_error
from xy_sysid.transfer_function import held_response

DELAYS = (0.0, 0.3e-3, 1.0e-3, 1.29e-3)
PLANTS = {
    "machine": paper_machine(),
    "resonance": function(np.array([3e4]), np.array([1.0, 100.0, 3e4])),
    "direct feedthrough": function(np.array([1.0, 50.0, 1e4]), np.array([1.0, 60.0, 2e4])),
    "one integrator": function(np.array([1.0]), np.array([1.0, 246.0, 0.0])),
}


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("name", PLANTS)
def test_held_response_is_the_exact_sampled_response(name: str, delay: float) -> None:
    """Hold, delay of any part of a sample, and aliases agree with matrix exponentials to 1e-7."""
    tf = function(PLANTS[name].numerator, PLANTS[name].denominator, delay)
    assert np.max(np.abs(held_response(tf, DENSE, RATE) / state_space_response(tf, DENSE) - 1)) < 1e-7


@pytest.mark.parametrize("delay", DELAYS)
def test_z_form_answers_as_the_held_machine(delay: float) -> None:
    """The discrete form has the response of hold, delay and plant."""
    tf = paper_machine(delay)
    z_form = discrete(tf, RATE)
    assert z_form.sampling_time == 1 / RATE
    assert np.max(np.abs(z_form.response(LINES) / held_response(tf, LINES, RATE) - 1)) < 1e-8


def test_simulation_repeats_the_frequency_response() -> None:
    """A periodic input, after the start has died out, comes back changed by the held response at its line."""
    tf = function(np.array([3e4]), np.array([1.0, 100.0, 3e4]), 1.29e-3)
    period, line = 400, 7
    u = np.tile(np.cos(2 * np.pi * line * np.arange(period) / period), 6)
    y = simulate(tf, RATE, u)[-period:]
    gain = np.fft.rfft(y)[line] / np.fft.rfft(u[-period:])[line]
    assert abs(gain / held_response(tf, np.array([line * RATE / period]), RATE)[0] - 1) < 1e-9


def test_simulation_error_counts_what_is_not_explained() -> None:
    """Noise of a tenth of the velocity's size leaves a fit of 90 %; an exact record one of 100 %."""
    rng = np.random.default_rng(0)
    u = rng.normal(size=20_000)
    tf = paper_machine()
    y = simulate(tf, RATE, u - u.mean())
    exact = simulation_error(tf, RATE, u, y)
    assert exact.compared == "velocity"
    assert exact.unit == "m/s"
    assert exact.nrmse > 99.999
    velocity = np.diff(y) * RATE
    noisy = np.concatenate(([0.0], np.cumsum(velocity + 0.1 * velocity.std() * rng.normal(size=velocity.size)))) / RATE
    assert simulation_error(tf, RATE, u, noisy).nrmse == pytest.approx(90.0, abs=1.0)


def test_poles_zeros_and_gains_are_the_machine_s() -> None:
    """Roots, modes and the velocity gain are those that the function was made of."""
    tf = paper_machine()
    assert tf.integrators == 1
    assert tf.gain == pytest.approx(0.097)
    assert sorted(round(mode.frequency, 6) for mode in tf.pole_modes()) == [0.0, round(246 / (2 * np.pi), 6), 47.0]
    (zero,) = tf.zero_modes()
    assert zero.frequency == pytest.approx(45.0)
    assert zero.damping == pytest.approx(0.03)


def test_stability_and_phase_type_are_told() -> None:
    """An integrator is stable enough, a right pole is not; a delay or a right zero is not minimum phase."""
    assert paper_machine(0.0).is_stable
    assert paper_machine(0.0).phase_type == "minimum"
    assert paper_machine().phase_type == "non-minimum"
    assert not function(np.array([1.0]), np.array([1.0, -3.0])).is_stable
    assert function(np.array([1.0, -5.0]), np.array([1.0, 3.0])).phase_type == "non-minimum"


def test_fourth_order_pade_form_is_the_delay_in_the_band() -> None:
    """Without delay, same response to 1e-4 up to 300 Hz."""
    tf = paper_machine()
    form = tf.pade(4)
    assert form.delay == 0.0
    assert form.denominator.size == tf.denominator.size + 4
    assert np.max(np.abs(form.response(LINES) / tf.response(LINES) - 1)) < 1e-4


def test_a_delay_cannot_be_negative() -> None:
    """A wrong call names the value, what is allowed, and the next act."""
    with pytest.raises(BadInput, match=r"delay is -0\.001 s; allowed: >= 0 s"):
        function(np.ones(1), np.ones(1), -1e-3)


def test_a_common_root_is_cancelled_and_nothing_else_changes() -> None:
    """minreal takes out a pole next to a zero; response, gain and integrator stay."""
    tf = paper_machine()
    padded = function(np.polymul(tf.numerator, [1.0, 500.0]), np.polymul(tf.denominator, [1.0, 500.01]), tf.delay)
    small = minreal(padded)
    assert np.allclose(small.removed, [-500.01])
    assert small.tf.denominator.size == tf.denominator.size
    assert small.tf.integrators == 1
    assert np.max(np.abs(small.tf.response(LINES) / padded.response(LINES) - 1)) < 1e-4
    assert minreal(tf).removed.size == 0


@pytest.mark.parametrize("order", [3, 4, 5])
def test_balanced_truncation_stays_within_its_bound(order: int) -> None:
    """The response of the reduced model is within twice the sum of the Hankel singular values that were cut."""
    tf = function(paper_machine().numerator * 9e6, np.polymul(paper_machine().denominator, [1.0, 3000.0, 9e6]), 1e-3)
    reduced = balanced_truncation(tf, order)
    assert reduced.tf.denominator.size == order + 1
    assert reduced.tf.integrators == 1
    assert np.max(np.abs(reduced.tf.response(LINES) - tf.response(LINES))) <= reduced.bound * (1 + 1e-6)
