"""Gauss-Newton and Levenberg-Marquardt on the weighted errors, by orthogonal factors, without normal equations.

Damping as in nllsfdi: lambda from 0.01, halved on success, times 10 on failure; columns scaled, and the damped step found by
rotations of the triangular factor (More, "The Levenberg-Marquardt algorithm", 1978).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from xy_sysid.fitting.prediction import Model, table
from xy_sysid.fitting.problem import Point, Problem, model, moved
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

LARGEST_DAMPING = 1e12
ROUNDING = 1e-26  # a cost below this fraction of the cost of a zero model is zero in double precision
NEAR_ROUNDING = 1e-20  # below this fraction, a failing step is attributed to rounding
RANK = 1e-13  # a direction whose factor is below this fraction of the largest is not changed


@dataclass(frozen=True, slots=True)
class Minimum:
    """Result of a minimisation, and the reason for its end; table: output of ``weighted`` at that point."""

    point: Point
    cost: float
    iterations: int
    converged: bool
    reason: str
    table: FloatArray


def weighted(task: Problem, at: Point) -> FloatArray:
    """(p + 1, 2 m), real parts before imaginary ones: rows of weighted derivatives to b, a[:-1] and, if free, the delay; the error."""
    return _table(task, model(task, at), at)


def minimise(task: Problem, start: Point, options: FitOptions) -> Minimum:
    """The local minimum of half the sum of squared weighted errors from a start, which must be in its own bases (``rebased``)."""
    here = model(task, start)
    rows, point = _table(task, here, start), start
    value = _half_square(rows)
    size = 0.5 * float(np.sum((task.weight * np.abs(task.frf.response)) ** 2))
    damped = options.method == "levenberg_marquardt"
    damping = options.damping if damped else 0.0
    if not np.isfinite(value):
        return Minimum(point=point, cost=float("inf"), iterations=0, converged=False, reason="The start gives no finite prediction.", table=rows)
    for iteration in range(options.max_iterations + 1):
        if value <= ROUNDING * size:
            return Minimum(
                point=point,
                cost=value,
                iterations=iteration,
                converged=True,
                reason="The model reproduces the data up to rounding errors.",
                table=rows,
            )
        upper, scale = _factor(task, rows, point)
        _, predicted = _step(upper, 0.0)
        if predicted <= options.relative_change * value:
            return Minimum(point=point, cost=value, iterations=iteration, converged=True, reason="No step lowers the cost: a minimum.", table=rows)
        if iteration == options.max_iterations:
            break
        while True:
            trial = _moved(task, point, _step(upper, damping)[0] / scale)
            trial_rows = _table(task, here, trial)
            trial_value = _half_square(trial_rows)
            if trial_value < value:
                break
            damping = damping * 10.0 if damped else max(damping * 10.0, 1e-6)
            if damping > LARGEST_DAMPING:
                rounding = value <= NEAR_ROUNDING * size
                reason = (
                    "The model reproduces the data up to rounding errors." if rounding else "No step lowers the cost, though its slope is not zero."
                )
                return Minimum(point=point, cost=value, iterations=iteration + 1, converged=rounding, reason=reason, table=rows)
        change = (value - trial_value) / value
        point, rows, value = trial, trial_rows, trial_value
        damping = damping * 0.5 if damped else 0.0
        if change <= options.relative_change:
            return Minimum(point=point, cost=value, iterations=iteration + 1, converged=True, reason="The cost no longer changes.", table=rows)
    return Minimum(
        point=point,
        cost=value,
        iterations=options.max_iterations,
        converged=False,
        reason=f"No convergence in {options.max_iterations} iterations.",
        table=rows,
    )


def _table(task: Problem, here: Model, at: Point) -> FloatArray:
    rows = table(here, at.b, at.a, at.delay, task.weight, task.frf.response)
    return rows if task.structure.free_delay else np.delete(rows, -2, axis=0)


def _half_square(rows: FloatArray) -> float:
    value = 0.5 * float(rows[-1] @ rows[-1])
    return value if np.isfinite(value) else float("inf")


def triangle(rows: FloatArray) -> FloatArray:
    """(p + 1, p + 1) upper triangular factor R of the table."""
    upper: FloatArray = _upper(lapack.dgeqrf(rows.T)[0], rows.shape[0])
    return upper


@compiled
def _upper(factors: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """(size, size) upper triangle of LAPACK's factors."""
    out = np.zeros((min(size, factors.shape[0]), size))
    for i in range(out.shape[0]):
        for j in range(i, size):
            out[i, j] = factors[i, j]
    return out


def _factor(task: Problem, rows: FloatArray, at: Point) -> tuple[FloatArray, FloatArray]:
    """(R of the scaled table, scales); a delay at its bound is fixed if the step would leave the bounds."""
    upper = triangle(rows)
    scale = _scaled(upper)
    if task.structure.free_delay and (at.delay <= 0.0 or at.delay >= task.structure.delay_max):
        pull = float(upper[:, -2] @ upper[:, -1])
        if (at.delay <= 0.0 and pull < 0) or (at.delay >= task.structure.delay_max and pull > 0):
            upper[:, -2] = 0.0
    return upper, scale


@compiled
def _scaled(upper: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths of the columns but the last, by which they are divided in place; 1 for a column of zeros."""
    scale = np.ones(upper.shape[1] - 1)
    for j in range(scale.shape[0]):
        total = 0.0
        for i in range(upper.shape[0]):
            total += upper[i, j] * upper[i, j]
        if total > 0.0:
            scale[j] = np.sqrt(total)
            for i in range(upper.shape[0]):
                upper[i, j] /= scale[j]
    return scale


@compiled
def _step(upper: NDArray[np.float64], damping: float) -> tuple[NDArray[np.float64], float]:
    """(step, reduction of the linearised cost): min |R x - q|^2 + damping |x|^2 with (R, q) the triangular factor."""
    size = upper.shape[0] - 1
    r, q = upper[:size, :size].copy(), upper[:size, size].copy()
    if damping > 0.0:
        for i in range(size):
            row = np.zeros(size)
            row[i], rest = np.sqrt(damping), 0.0
            for k in range(i, size):
                if row[k] == 0.0:
                    continue
                length = np.sqrt(r[k, k] * r[k, k] + row[k] * row[k])
                cosine, sine = r[k, k] / length, row[k] / length
                for j in range(k, size):
                    r[k, j], row[j] = cosine * r[k, j] + sine * row[j], cosine * row[j] - sine * r[k, j]
                q[k], rest = cosine * q[k] + sine * rest, cosine * rest - sine * q[k]
    largest = 0.0
    for i in range(size):
        largest = max(largest, abs(r[i, i]))
    x = np.zeros(size)
    for i in range(size - 1, -1, -1):
        if abs(r[i, i]) > RANK * largest:
            total = q[i]
            for j in range(i + 1, size):
                total -= r[i, j] * x[j]
            x[i] = total / r[i, i]
    gain = 0.0
    for i in range(size):
        left = upper[i, size]
        for j in range(i, size):
            left -= upper[i, j] * x[j]
        gain += 0.5 * (upper[i, size] ** 2 - left * left)
    return x, gain


def _moved(task: Problem, at: Point, step: FloatArray) -> Point:
    split = at.b.size
    a = at.a.copy()
    a[:-1] += step[split : split + a.size - 1]
    delay = min(max(at.delay + float(step[-1]), 0.0), task.structure.delay_max) if task.structure.free_delay else at.delay
    return moved(at, at.b + step[:split], a, delay)
