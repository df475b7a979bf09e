"""Gauss-Newton and Levenberg-Marquardt on the weighted errors, by orthogonal factors, never by normal equations.

Damping as in nllsfdi: lambda from 0.01, halved on success, times 10 on failure; columns scaled (More, 1978).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.fitting.prediction import Model, predict
from xy_sysid.fitting.problem import Point, Problem, model, moved, rebased
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.frf import ComplexArray
from xy_sysid.stream import FloatArray

LARGEST_DAMPING = 1e12
ROUNDING = 1e-26  # a cost below this part of the data's own is zero in double precision
NEAR_ROUNDING = 1e-20  # below this part, a step that fails is blamed on rounding


@dataclass(frozen=True, slots=True)
class Minimum:
    """Where a minimisation ended, and why."""

    point: Point
    cost: float
    iterations: int
    converged: bool
    reason: str


def minimise(task: Problem, start: Point, options: FitOptions) -> Minimum:
    """The nearest minimum of half the sum of squared weighted errors."""
    point = rebased(task, start)
    here = model(task, point)
    table = _table(task, here, point)
    value = _half_square(table)
    floor = ROUNDING * 0.5 * float(np.sum((task.weight * np.abs(task.frf.response)) ** 2))
    damped = options.method == "levenberg_marquardt"
    damping = options.damping if damped else 0.0
    if not np.isfinite(value):
        return Minimum(point, float("inf"), 0, False, "The start gives no finite prediction.")
    for iteration in range(1, options.max_iterations + 1):
        upper, scale = _factor(task, table, point)
        while True:
            trial = _moved(task, point, _step(upper, scale, damping))
            trial_table = _table(task, here, trial)
            trial_value = _half_square(trial_table)
            if trial_value < value:
                break
            predicted = 0.5 * float(np.sum(upper[:-1, -1] ** 2))
            if predicted <= options.relative_change * value or value <= floor:
                return Minimum(point, value, iteration, True, "No step lowers the cost: a minimum.")
            damping = damping * 10.0 if damped else max(damping * 10.0, 1e-6)
            if damping > LARGEST_DAMPING and value <= floor / ROUNDING * NEAR_ROUNDING:
                return Minimum(point, value, iteration, True, "The model reproduces the data to rounding.")
            if damping > LARGEST_DAMPING:
                return Minimum(point, value, iteration, False, "No step lowers the cost, though its slope is not zero.")
        change = (value - trial_value) / value
        point, table, value = trial, trial_table, trial_value
        damping = damping * 0.5 if damped else 0.0
        if value <= floor:
            return Minimum(point, value, iteration, True, "The model reproduces the data to rounding.")
        if change <= options.relative_change:
            return Minimum(point, value, iteration, True, "The cost changes no more.")
    return Minimum(point, value, options.max_iterations, False, f"No convergence in {options.max_iterations} iterations.")


def weighted_jacobian(task: Problem, at: Point) -> tuple[ComplexArray, ComplexArray]:
    """(prediction, (m, p) weighted derivatives to b, a[:-1] and, if it is free, the delay)."""
    out = predict(model(task, at), at.b, at.a, at.delay, True)
    last = out.shape[1] if task.structure.free_delay else out.shape[1] - 1
    return out[:, 0], out[:, 1:last] * task.weight[:, None]


def _table(task: Problem, here: Model, at: Point) -> FloatArray:
    """(2 m, p + 1): weighted derivatives and, last, weighted data minus prediction; real parts over imaginary ones."""
    out = predict(here, at.b, at.a, at.delay, True)
    table = np.empty((2 * out.shape[0], out.shape[1] - int(not task.structure.free_delay)))
    out[:, 0] = task.frf.response - out[:, 0]
    out *= task.weight[:, None]
    half, columns = out.shape[0], table.shape[1]
    table[:half, :-1], table[half:, :-1] = out[:, 1:columns].real, out[:, 1:columns].imag
    table[:half, -1], table[half:, -1] = out[:, 0].real, out[:, 0].imag
    return table


def _half_square(table: FloatArray) -> float:
    value = 0.5 * float(table[:, -1] @ table[:, -1])
    return value if np.isfinite(value) else float("inf")


def _factor(task: Problem, table: FloatArray, at: Point) -> tuple[FloatArray, FloatArray]:
    """(R of the scaled table, scales); a delay at its limit that wants to go further is held."""
    scale = np.sqrt(np.sum(table[:, :-1] ** 2, axis=0))
    scale[~(scale > 0)] = 1.0
    scaled = table / np.append(scale, 1.0)
    if task.structure.free_delay:
        pull = float(scaled[:, -2] @ scaled[:, -1])
        if (at.delay <= 0.0 and pull < 0) or (at.delay >= task.structure.delay_max and pull > 0):
            scaled[:, -2] = 0.0
    return np.asarray(np.linalg.qr(scaled, mode="r")), scale


def _step(upper: FloatArray, scale: FloatArray, damping: float) -> FloatArray:
    size = scale.size
    left, right = upper[:size, :size], upper[:size, size]
    if damping > 0:
        left = np.concatenate((left, np.sqrt(damping) * np.eye(size)))
        right = np.concatenate((right, np.zeros(size)))
    return np.asarray(np.linalg.lstsq(left, right, rcond=1e-13)[0] / scale)


def _moved(task: Problem, at: Point, step: FloatArray) -> Point:
    split = at.b.size
    a = at.a.copy()
    a[:-1] += step[split : split + a.size - 1]
    delay = float(np.clip(at.delay + step[-1], 0.0, task.structure.delay_max)) if task.structure.free_delay else at.delay
    return moved(at, at.b + step[:split], a, delay)
