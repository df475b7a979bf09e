"""Smaller models with the response of the larger ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.fitting_data import RATE, lines, paper_machine
from helpers.sampled import discrete

from xy_sysid.errors import BadInput
from xy_sysid.linear.reduction import balanced_truncation, minreal
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray

WIDE = np.geomspace(0.01, 1e5, 4000)


def polynomial(*roots: float) -> FloatArray:
    return np.asarray(np.poly(roots), dtype=np.float64)


def times(tf: TransferFunction, numerator: list[float], denominator: list[float]) -> TransferFunction:
    return replace(tf, numerator=np.convolve(tf.numerator, numerator), denominator=np.convolve(tf.denominator, denominator))


def test_a_pole_and_a_zero_on_each_other_go() -> None:
    """Real and paired; delay, gain and response are kept."""
    tf = paper_machine()
    larger = times(times(tf, [1.0, 500.0], [1.0, 500.02]), [1.0, 80.0, 9e5], [1.0, 80.001, 9.00001e5])
    small = minreal(larger)
    assert small.removed.size == 3
    assert small.tf.denominator.size == tf.denominator.size
    assert small.tf.delay == tf.delay
    assert small.tf.gain == pytest.approx(larger.gain)
    assert np.max(np.abs(small.tf.response(lines()) / tf.response(lines()) - 1.0)) < 2e-3


def test_what_only_lies_near_stays() -> None:
    """The antiresonance and resonance of the base are 3 % apart: no cancellation."""
    small = minreal(paper_machine())
    assert small.removed.size == 0
    assert small.tf is not None and np.array_equal(small.tf.denominator, paper_machine().denominator)


def test_cancellation_works_in_z() -> None:
    """Two equal roots inside the unit circle."""
    tf = TransferFunction(np.array([0.2, -0.1]), np.array([1.0, -1.3, 0.4]), 0.0, 1 / RATE)
    small = minreal(tf)
    assert np.allclose(small.removed, [0.5])
    assert np.allclose(small.tf.denominator, [1.0, -0.8])
    assert np.allclose(small.tf.response(lines()), tf.response(lines()))


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_balanced_truncation_keeps_its_bound(order: int) -> None:
    """The error never exceeds twice the sum of the removed Hankel singular values, and is not far below it."""
    tf = TransferFunction(np.array([1.0]), np.ones(1))
    for pole, zero in ((20.0, 25.0), (90.0, 60.0), (300.0, 1000.0), (1500.0, 1200.0), (4000.0, 9000.0)):
        tf = times(tf, [1.0 / zero, 1.0], [1.0 / pole, 1.0])
    tf = replace(tf, numerator=tf.numerator / tf.denominator[0], denominator=tf.denominator / tf.denominator[0], delay=1e-3)
    cut = balanced_truncation(tf, order)
    error = float(np.max(np.abs(cut.tf.response(WIDE) - tf.response(WIDE))))
    assert cut.tf.denominator.size == order + 1
    assert cut.hankel.size == 5 and np.all(np.diff(cut.hankel) <= 0)
    assert error <= cut.bound * (1 + 1e-6) + 1e-9
    assert cut.tf.is_stable and cut.tf.delay == 1e-3
    if order == 5:
        assert cut.bound == pytest.approx(0.0)


def test_integrators_stay_when_states_are_cut() -> None:
    """The paper's machine without its weak base mode: a rigid axis with nearly the same velocity gain."""
    tf = paper_machine()
    cut = balanced_truncation(tf, 2)
    assert cut.tf.integrators == 1
    assert cut.tf.gain == pytest.approx(0.097, rel=0.05)
    frequency = lines()
    assert np.max(np.abs(cut.tf.response(frequency) - tf.response(frequency))) <= cut.bound * (1 + 1e-6)


def test_truncation_works_in_z_and_keeps_unstable_poles() -> None:
    """A sampled stable function within its bound; a pole in the right half plane is kept."""
    sampled = discrete(TransferFunction(np.array([1.0, 3000.0, 5e6]), polynomial(-40.0, -700.0, -2500.0, -900.0)), RATE)
    cut, frequency = balanced_truncation(sampled, 2), lines(900, 1.1)
    assert np.max(np.abs(cut.tf.response(frequency) - sampled.response(frequency))) <= cut.bound * (1 + 1e-6)
    unstable = TransferFunction(np.array([1.0, 50.0]), polynomial(30.0, -200.0, -900.0))
    assert np.max(balanced_truncation(unstable, 2).tf.poles().real) == pytest.approx(30.0)


def test_an_order_out_of_range_is_refused() -> None:
    """The error names the poles that must be kept."""
    with pytest.raises(BadInput, match="order is 0; allowed: 1 to 4"):
        balanced_truncation(paper_machine(), 0)
