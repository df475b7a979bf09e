"""Poles, zeros, stability, phase type, Pade form of a transfer function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.fitting_data import RATE, lines, paper_machine
from helpers.sampled import discrete

from xy_sysid.errors import BadInput
from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction


def test_the_response_is_the_quotient_turned_by_the_delay() -> None:
    """N(jw) / D(jw) exp(-jw delay), and the same in z."""
    tf = TransferFunction(np.array([2.0, 3.0]), np.array([1.0, 4.0, 5.0]), 0.01)
    s = 2j * np.pi * 7.0
    assert tf.response(np.array([7.0]))[0] == pytest.approx((2 * s + 3) / (s**2 + 4 * s + 5) * np.exp(-0.01 * s))
    sampled = TransferFunction(np.array([0.1]), np.array([1.0, -0.9]), 0.02, 0.01)
    z = np.exp(2j * np.pi * 7.0 * 0.01)
    assert sampled.response(np.array([7.0]))[0] == pytest.approx(0.1 / (z - 0.9) / z**2)


def test_roots_gain_and_integrators() -> None:
    """The roots of the paper's machine, whose coefficients span eight powers of ten."""
    tf = paper_machine()
    pair, zero = 2 * np.pi * 47.56, 2 * np.pi * 46.2
    assert np.allclose(np.sort(np.abs(tf.poles())), [0.0, 246.0, pair, pair])
    assert np.allclose(np.abs(tf.zeros()), zero)
    assert tf.integrators == 1
    assert tf.gain == pytest.approx(0.097)
    assert tf.leading_gain == pytest.approx(0.097 * 246.0 * (pair / zero) ** 2)
    mode = next(m for m in tf.pole_modes() if m.root.imag > 0)
    assert mode.frequency == pytest.approx(47.56)
    assert mode.damping == pytest.approx(0.04)
    assert tf.zero_modes()[0].damping == pytest.approx(0.015)


def test_gain_and_modes_survive_the_step_to_z() -> None:
    """The velocity gain and the natural frequencies of the exact discrete form are those of the continuous one."""
    tf = discrete(paper_machine(1e-3), RATE)
    assert tf.integrators == 1
    assert tf.gain == pytest.approx(0.097, rel=1e-6)
    mode = next(m for m in tf.pole_modes() if m.root.imag > 0)
    assert mode.frequency == pytest.approx(47.56)
    assert mode.damping == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("denominator", "period", "stable"),
    [
        ([1.0, 2.0, 3.0], None, True),
        ([1.0, 0.0, 0.0], None, True),
        ([1.0, -2.0, 3.0], None, False),
        ([1.0, 0.0, -4.0], None, False),
        ([1.0, -0.5], 0.01, True),
        ([1.0, -1.0], 0.01, True),
        ([1.0, -1.2], 0.01, False),
        ([1.0, 0.0, 1.21], 0.01, False),
    ],
)
def test_stability(denominator: list[float], period: float | None, stable: bool) -> None:
    """No pole in the right half plane (outside the unit circle); integrators are allowed."""
    assert TransferFunction(np.ones(1), np.array(denominator), 0.0, period).is_stable is stable


def test_phase_type() -> None:
    """Minimum phase has no delay, and neither zeros nor poles in the right half plane."""
    minimum = TransferFunction(np.array([1.0, 2.0]), np.array([1.0, 3.0, 4.0]))
    assert minimum.phase_type == "minimum"
    assert replace(minimum, delay=1e-3).phase_type == "non-minimum"
    assert replace(minimum, numerator=np.array([1.0, -2.0])).phase_type == "non-minimum"
    assert replace(minimum, denominator=np.array([1.0, -3.0, 4.0])).phase_type == "non-minimum"


def test_the_pade_form_of_order_four_replaces_the_delay() -> None:
    """Its known coefficients for a delay of 1 s; all-pass; accurate to 1e-4 up to a phase of 2.4 rad."""
    tf = TransferFunction(np.ones(1), np.ones(1), 1.0).pade(4)
    assert np.allclose(tf.denominator, [1.0, 20.0, 180.0, 840.0, 1680.0])
    assert np.allclose(tf.numerator, [1.0, -20.0, 180.0, -840.0, 1680.0])
    machine = paper_machine()
    pade, frequency = machine.pade(), lines()
    assert pade.delay == 0.0 and pade.denominator.size == 9
    assert np.max(np.abs(pade.response(frequency) / machine.response(frequency) - 1.0)) < 1e-4
    assert np.allclose(np.abs(pade.response(frequency)), np.abs(machine.response(frequency)))
    assert machine.pade(6).denominator.size == 11
    prompt = paper_machine(0.0)
    assert prompt.pade() is prompt


def test_the_delay_of_a_discrete_function_becomes_poles_at_zero() -> None:
    """Two samples, two poles; the same response."""
    tf = TransferFunction(np.array([0.1]), np.array([1.0, -0.9]), 0.02, 0.01)
    pade = tf.pade()
    assert np.sum(pade.poles() == 0) == 2
    assert np.allclose(pade.response(lines(40, 1.0)), tf.response(lines(40, 1.0)))


def test_a_hold_at_low_frequency_is_half_a_sample_of_delay() -> None:
    """A known limit: H behind a hold is H exp(-jw T / 2), to the square of w T."""
    tf, frequency = paper_machine(), np.array([1.0, 2.0])
    assert np.max(np.abs(held_response(tf, frequency, RATE) / (tf.response(frequency) * np.exp(-1j * np.pi * frequency / RATE)) - 1)) < 2e-5


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: TransferFunction(np.ones(1), np.ones(2), -1e-3), "delay is -0.001 s; allowed: >= 0 s"),
        (lambda: TransferFunction(np.ones(1), np.ones(2), float("nan")), "delay is nan s"),
        (lambda: TransferFunction(np.ones(1), np.zeros(2)), "denominator is zero"),
        (lambda: paper_machine().pade(11), "Pade order is 11; allowed: 1 to 10"),
    ],
)
def test_nonsense_is_refused(make: object, says: str) -> None:
    """In one line."""
    assert callable(make)
    with pytest.raises(BadInput) as caught:
        make()
    assert says in str(caught.value)
