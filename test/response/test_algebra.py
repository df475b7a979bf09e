"""Responses add, multiply, invert and close a loop, with their uncertainty and units."""

from __future__ import annotations

import numpy as np
import pytest

import xy_sysid as xy
from xy_sysid.errors import BadInput
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

F = np.linspace(1.0, 100.0, 100)


def measured(scale: complex, sigma: float, units: tuple[str, str] = ("V", "m"), lines: slice = slice(None)) -> FrequencyResponse:
    """A response that falls with frequency."""
    f = F[lines]
    return xy.frf_from(f, scale / (1 + 0.1j * f), sigma=np.full(f.size, sigma), units={"input": units[0], "output": units[1]})


def test_a_sum_and_a_difference_carry_both_errors() -> None:
    """Independent errors add as squares."""
    one, other = measured(2.0, 0.03), measured(1.0, 0.04)
    np.testing.assert_allclose((one + other).response, 1.5 * one.response)
    np.testing.assert_allclose((one - other).response, 0.5 * one.response)
    np.testing.assert_allclose((one + other).sigma, 0.05)
    np.testing.assert_allclose((one * 2.0).sigma, 0.06)


def test_a_product_is_one_after_the_other() -> None:
    """Units are combined: m per V after V per A is m per A; the reverse order is refused."""
    plant, drive = measured(2.0, 0.01), measured(3.0, 0.02, ("A", "V"))
    both = plant * drive
    assert (both.input_unit, both.output_unit) == ("A", "m")
    np.testing.assert_allclose(both.response, plant.response * drive.response)
    np.testing.assert_allclose(both.sigma, np.hypot(0.01 * np.abs(drive.response), 0.02 * np.abs(plant.response)))
    with pytest.raises(BadInput, match="units of the product"):
        drive * plant


def test_a_loop_is_closed_with_a_controller_of_any_kind() -> None:
    """P C / (1 + P C), by a number, a transfer function or a measured controller; sensitivity to the plant's error is 1 / (1 + P C)^2."""
    plant = measured(2.0, 0.01)
    controller = TransferFunction(np.array([5.0]), np.array([1.0]), input_unit="m", output_unit="V")
    for given in (5.0, controller, measured(5.0, 0.0, ("m", "V")) * 0.0 + 5.0):
        loop = plant.closed_loop(given)
        np.testing.assert_allclose(loop.response, 5 * plant.response / (1 + 5 * plant.response), rtol=1e-9)
        np.testing.assert_allclose(loop.sigma, 0.05 / np.abs(1 + 5 * plant.response) ** 2, rtol=1e-6)
        assert (loop.input_unit, loop.output_unit) == ("m", "m")
    with pytest.raises(BadInput, match="units of the loop"):
        plant.closed_loop(plant)


def test_an_inverse_undoes() -> None:
    """Input over output, with the same relative error."""
    one = measured(2.0, 0.01)
    turned = one.inverse()
    np.testing.assert_allclose((turned.inverse()).response, one.response)
    np.testing.assert_allclose(turned.sigma / np.abs(turned.response), one.sigma / np.abs(one.response))
    assert (turned.input_unit, turned.output_unit) == ("m", "V")


def test_other_lines_are_brought_to_the_first_ones() -> None:
    """Within the common band; without one it is refused."""
    one, other = measured(2.0, 0.01), measured(1.0, 0.01, lines=slice(10, 60, 2))
    both = one + other
    assert (both.frequency[0], both.frequency[-1]) == (F[10], F[58])
    np.testing.assert_allclose(both.response, 1.5 * one.band(F[10], F[58]).response, rtol=2e-3)
    with pytest.raises(BadInput, match="bands"):
        measured(1.0, 0.01, lines=slice(0, 20)) + measured(1.0, 0.01, lines=slice(30, 60))


def test_several_responses_are_drawn_together() -> None:
    """bode accepts any number of responses and models."""
    figure = xy.plot.bode(measured(2.0, 0.01), measured(1.0, 0.01))
    assert len({trace.name for trace in figure.data if trace.name and "band" not in trace.name}) == 2
