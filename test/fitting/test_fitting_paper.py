"""The paper's method, for comparison: exactly nllsfdi, and with the paper's large error if a delay is absorbed."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from helpers.fitting_data import held, lines, measured, paper_machine

from xy_sysid.errors import BadInput
from xy_sysid.fitting import FitOptions, Structure, identify, nllsfdi
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray


def literal(response: ComplexArray, frequency: FloatArray, n: int, m: int, gauss_newton: bool) -> tuple[FloatArray, FloatArray, float, int]:
    """(numerator, denominator in rad/s, cost, iterations): an independent implementation from the description of the routine."""
    axis = 2j * np.pi * frequency
    unit = float(np.median(np.abs(axis)))
    s, weight = axis / unit, 1.0 / np.abs(response)

    def stack(z: ComplexArray) -> FloatArray:
        return np.vstack([z.real, z.imag]) if z.ndim > 1 else np.hstack([z.real, z.imag])

    def equations(w: FloatArray) -> FloatArray:
        table = np.column_stack([w * response * s**k for k in range(n - 1, -1, -1)] + [-w * s**k for k in range(m, -1, -1)])
        return np.asarray(-np.linalg.pinv(stack(table), rcond=2 * s.size * np.finfo(float).eps) @ stack(w * response * s**n))

    def at(y: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        return np.asarray(np.polyval(y[n:], s)), np.asarray(s**n + np.polyval(y[:n], s))

    y = equations(weight)
    y = equations(weight / np.abs(at(y)[1]))

    def cost_of(y: FloatArray) -> float:
        b, a = at(y)
        return float(0.5 * np.sum(np.abs(weight * (response - b / a)) ** 2))

    cost, lam, change, count = cost_of(y), 0.0 if gauss_newton else 0.01, np.inf, 0
    while count < 100 and abs(change) > 1e-10:
        count += 1
        b, a = at(y)
        jacobian = stack(np.column_stack([weight * b / a**2 * s**k for k in range(n - 1, -1, -1)] + [-weight / a * s**k for k in range(m, -1, -1)]))
        square = np.diag(jacobian.T @ jacobian)
        extra = np.diag(np.sqrt(lam * (square + square.max() * np.finfo(float).eps)))
        whole = np.vstack([jacobian, extra])
        right = np.hstack([stack(weight * (response - b / a)), np.zeros(y.size)])
        trial = y - np.linalg.pinv(whole, rcond=max(whole.shape) * np.finfo(float).eps) @ right
        change = (cost_of(trial) - cost) / cost
        if cost_of(trial) < cost or gauss_newton:
            y, cost, lam = trial, cost_of(trial), lam / 2
        else:
            lam *= 10
    numerator = y[n:] * unit ** (n - np.arange(m, -1, -1.0))
    denominator = np.concatenate(([1.0], y[:n])) * unit ** (n - np.arange(n, -1, -1.0))
    return numerator, denominator, cost, count


@pytest.mark.parametrize("method", ["levenberg_marquardt", "gauss_newton"])
def test_the_papers_path_is_nllsfdi_step_by_step(method: Literal["levenberg_marquardt", "gauss_newton"]) -> None:
    """n = 4, numerator 2..0, 100 iterations, 1e-10: the same coefficients, cost and number of steps as the independent implementation."""
    random = np.random.default_rng(2)
    exact = held(paper_machine(), lines()[20:])
    noisy = exact.response * (1 + 0.01 * (random.standard_normal(593) + 1j * random.standard_normal(593)))
    fit = nllsfdi.fit(replace(exact, response=noisy), Structure(), options=FitOptions(method=method))
    numerator, denominator, cost, count = literal(noisy, exact.frequency, 4, 2, method == "gauss_newton")
    assert fit.iterations == count
    assert fit.cost == pytest.approx(cost, rel=1e-9)
    assert np.allclose(fit.tf.numerator, numerator, rtol=1e-5)
    assert np.allclose(fit.tf.denominator, denominator, rtol=1e-5)


def test_a_delay_absorbed_leaves_a_large_error() -> None:
    """On the machine of the paper the fourth order without delay is more than 10 per cent off; with delay and hold it is exact."""
    frf = held(paper_machine(), lines()[9:])
    absorbed, ours = nllsfdi.fit(frf, Structure()), identify(frf, Structure())
    assert absorbed.error_cost > 10.0
    assert absorbed.confidence == pytest.approx(100.0 - absorbed.error_cost)
    assert ours.error_cost < 1e-6
    assert absorbed.tf.delay == 0.0


def test_the_papers_path_says_what_it_cannot_do() -> None:
    """No z domain."""
    with pytest.raises(BadInput, match="domain"):
        nllsfdi.fit(held(paper_machine()), Structure(domain="z", delay=0.0))


def test_an_unstable_model_is_called_so() -> None:
    """Negative coefficients of a denominator mean poles in the right half plane."""
    true = TransferFunction(np.array([1e5]), np.array([1.0, -50.0, 1e5]))
    fit = nllsfdi.fit(measured(lines(), true.response(lines())), Structure(0, 2, 0))
    assert not fit.tf.is_stable
    assert any(warning.startswith("Unstable: poles at 25") for warning in fit.warnings)
