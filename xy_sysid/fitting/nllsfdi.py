"""The paper's own method, as in the MATLAB routine nllsfdi (nlsfdi): for comparison only.

Frequency axis scaled by the median of |j w|; LLS by pseudo-inverse; one LLS re-weighted by 1 / |A|; then Gauss-Newton or
Levenberg-Marquardt on powers of s: each column's own square damped by lambda = 0.01, halved on success, times 10 on failure. It
stops when the cost changes by 1e-10 of itself or less, up or down, or after 100 iterations. Cost = half the sum of squared errors
weighted by 1 / |FRF|. There is no delay, no hold and no window in its model: a delay of the machine is absorbed by the
polynomials. (T. Beauduin, FdiTools; Pintelon & Schoukens, System Identification, 2nd ed., 9.9)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.problem import in_bases, problem
from xy_sysid.fitting.result import Ended, Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

DEFAULTS = FitOptions()


@dataclass(frozen=True, slots=True)
class _Data:
    s: ComplexArray
    response: ComplexArray
    weight: FloatArray
    n: int
    m: int


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """Fit numerator_order over denominator_order powers of s, all poles free; ``start`` is ignored.

    Integrators, delay, hold and weighting of the structure are ignored. Raises BadInput for too few lines or domain "z".
    """
    del start
    if structure.domain != "s":
        raise BadInput("domain", repr(structure.domain), "'s' for the paper's path", "Use another estimator.")
    literal = replace(structure, integrators=0, delay=0.0, hold="none", weighting="relative")
    bare = replace(frf, kernel_offset=np.zeros(1), kernel_weight=np.ones(1), kernel_amplitude=np.zeros(0), differenced=False)
    task = problem(bare, literal)
    data = _Data(s=task.plan.line, response=task.frf.response, weight=task.weight, n=literal.denominator_order, m=literal.numerator_order)
    first = _linear(data, data.weight)
    theta = _linear(data, data.weight / np.abs(_split(data, first)[1]))
    theta, iterations, converged = _iterate(data, theta, options)
    up, down = _split(data, theta)
    point = in_bases(task, up, down, 0.0, data.weight / np.abs(down))
    reason = "The cost no longer changes." if converged else f"No convergence in {iterations} iterations."
    return finish(task, point, "nllsfdi", Ended(iterations, converged, reason), "two linear least squares")


def _split(data: _Data, theta: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """(B, A) on the lines; theta holds a_(n-1) .. a_0, b_m .. b_0, with A monic in the scaled variable."""
    down = np.polyval(np.concatenate(([1.0], theta[: data.n])), data.s)
    up = np.polyval(theta[data.n :], data.s)
    return np.asarray(up, dtype=np.complex128), np.asarray(down, dtype=np.complex128)


def _powers(s: ComplexArray, highest: int) -> ComplexArray:
    return np.asarray(s[:, None] ** np.arange(highest, -1, -1), dtype=np.complex128)


def _pinv(table: FloatArray) -> FloatArray:
    """The pseudo-inverse with MATLAB's tolerance."""
    return np.asarray(np.linalg.pinv(table, rcond=max(table.shape) * np.finfo(float).eps))


def _linear(data: _Data, weight: FloatArray) -> FloatArray:
    """min sum weight^2 |response A - B|^2 by the pseudo-inverse."""
    regressor = np.concatenate((-data.response[:, None] * _powers(data.s, data.n - 1), _powers(data.s, data.m)), axis=1) * weight[:, None]
    right = data.response * data.s**data.n * weight
    return np.asarray(_pinv(np.concatenate((regressor.real, regressor.imag))) @ np.concatenate((right.real, right.imag)))


def _error(data: _Data, theta: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """(weighted error, its Jacobian, cost), real parts over imaginary ones."""
    up, down = _split(data, theta)
    error = data.weight * (up / down - data.response)
    slope = np.concatenate((-(up / down**2)[:, None] * _powers(data.s, data.n - 1), _powers(data.s, data.m) / down[:, None]), axis=1)
    slope = slope * data.weight[:, None]
    stacked = np.concatenate((error.real, error.imag))
    return stacked, np.concatenate((slope.real, slope.imag)), 0.5 * float(stacked @ stacked)


def _iterate(data: _Data, theta: FloatArray, options: FitOptions) -> tuple[FloatArray, int, bool]:
    damped = options.method == "levenberg_marquardt"
    damping = options.damping if damped else 0.0
    error, slope, cost = _error(data, theta)
    for iteration in range(1, options.max_iterations + 1):
        squares = np.sum(slope**2, axis=0)
        below = np.diag(np.sqrt(damping * (squares + np.max(squares) * np.finfo(float).eps)))
        step = _pinv(np.concatenate((slope, below))) @ np.concatenate((error, np.zeros(theta.size)))
        trial = theta - step
        trial_error, trial_slope, trial_cost = _error(data, trial)
        if not np.isfinite(trial_cost):
            return theta, iteration, False
        change = abs(trial_cost - cost) / cost if cost > 0 else 0.0
        if trial_cost < cost or not damped:
            theta, error, slope, cost = trial, trial_error, trial_slope, trial_cost
            damping *= 0.5
        else:
            damping *= 10.0
        if change <= options.relative_change:
            return theta, iteration, True
    return theta, options.max_iterations, False
