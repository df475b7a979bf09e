"""Linear least squares for N and D, plain and re-weighted by the last denominator.

Levy, "Complex-curve fitting", IRE Trans. 1959; Sanathanan & Koerner, IEEE Trans. Automatic Control 8, 1963. Hold, window
and delay enter as a correction of the data: the difference that they make in the prediction of the last model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from xy_sysid.fitting.basis import Basis, arnoldi, values_of
from xy_sysid.fitting.plan import plan_for
from xy_sysid.fitting.problem import Point, Problem, cost, rational, response
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

SCAN_STEPS = 4  # reweightings at each delay of the scan: enough to rank delays
MOST_DELAYS = 400  # of one scan; with more, lower lines select a range first
SMALLEST = 1e-14  # part of the largest diagonal below which a coefficient is not determined
FOLLOWED = 6  # best delays of the lower lines around which the fine grid is searched


def linear_step(task: Problem, delay: float, last: Point | None, correct: bool) -> Point:
    """One linear fit at a delay, weighted by the last denominator; the first one (last=None) is Levy's."""
    factor = task.plan.line_factor * np.exp(-1j * task.plan.line_omega * delay)
    data = task.frf.response
    weight: ComplexArray = task.weight.astype(np.complex128)
    if last is not None:
        up, down = rational(task, last)
        weight = weight / (down / np.max(np.abs(down)))
        if correct:
            data = data - (response(task, last) - factor * up / down)
    structure = task.structure
    return _point(_solved(task.plan.line, weight * factor, weight * data, structure.numerator_order, structure.free_order)[:5], delay)


def _point(solved: tuple[float, FloatArray, float, FloatArray, FloatArray], delay: float) -> Point:
    """A solution as a model; the last coefficient of the denominator is 1."""
    n_first, n_recurrence, d_first, d_recurrence, solution = solved
    split = n_recurrence.shape[0]
    b, a = solution[:split], np.append(solution[split:], 1.0)
    return Point(numerator=Basis(n_first, n_recurrence), denominator=Basis(d_first, d_recurrence), b=b, a=a, delay=delay)


@compiled
def _solved(
    line: NDArray[np.complex128], n_weight: NDArray[np.complex128], d_weight: NDArray[np.complex128], n_order: int, d_order: int
) -> tuple[float, NDArray[np.float64], float, NDArray[np.float64], NDArray[np.float64], NDArray[np.complex128], NDArray[np.complex128]]:
    """The least-squares solution of n_weight N = d_weight D: both bases (first, recurrence), the coefficients, and N and D on the lines."""
    lines, split, size = line.shape[0], n_order + 1, n_order + 1 + d_order
    n_size, d_size = np.empty(lines), np.empty(lines)
    for i in range(lines):
        n_size[i], d_size[i] = abs(n_weight[i]), abs(d_weight[i])
    n_first, n_recurrence = arnoldi(line, n_size, n_order)
    d_first, d_recurrence = arnoldi(line, d_size, d_order)
    left, right = values_of(line, n_first, n_recurrence), values_of(line, d_first, d_recurrence)
    table = np.empty((size + 1, 2 * lines))  # a row for each coefficient, the known side last; real parts, then imaginary ones
    for k in range(size + 1):
        for i in range(lines):
            value = n_weight[i] * left[i, k] if k < split else d_weight[i] * right[i, k - split]
            if split <= k < size:
                value = -value
            table[k, i], table[k, lines + i] = value.real, value.imag
    solution = _least(table)
    up, down = np.empty(lines, dtype=np.complex128), np.empty(lines, dtype=np.complex128)
    for i in range(lines):
        up[i], down[i] = 0.0, right[i, d_order]
        for k in range(split):
            up[i] += left[i, k] * solution[k]
        for k in range(d_order):
            down[i] += right[i, k] * solution[split + k]
    return n_first, n_recurrence, d_first, d_recurrence, solution, up, down


@compiled
def _least(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """x that minimises |sum_k x_k table[k] - table[-1]|; all 0 if a number is not finite."""
    size = table.shape[0] - 1
    if not np.all(np.isfinite(table)):
        return np.zeros(size)
    upper = np.linalg.qr(table.T)[1]
    found: FloatArray = np.linalg.lstsq(np.ascontiguousarray(upper[:size, :size]), np.ascontiguousarray(upper[:size, size]), SMALLEST)[0]
    return found


def reweighted(task: Problem, delay: float, steps: int, start: Point | None = None) -> tuple[Point, float, int]:
    """(best point, its cost, steps done): linear steps until the cost settles."""
    point = linear_step(task, delay, start, start is not None)
    best, lowest = point, cost(task, response(task, point))
    previous = lowest
    for number in range(1, steps):
        if not np.isfinite(previous):
            return best, lowest, number
        point = linear_step(task, delay, point, True)
        value = cost(task, response(task, point))
        if value < lowest:
            best, lowest = point, value
        if abs(previous - value) <= 1e-6 * value:
            return best, lowest, number + 1
        previous = value
    return best, lowest, steps


def scan(task: Problem, steps: int, options: FitOptions) -> list[tuple[float, float, Point]]:
    """(cost, delay, point) at the best delays, best first: local minima of the cost over a grid of delays.

    If the grid has more than ``MOST_DELAYS`` delays, the lines at low frequencies first select those around which the fine grid is searched.
    """
    structure, top = task.structure, float(task.frf.frequency[-1])
    if structure.delay != "free":
        point, value, _ = reweighted(task, structure.delay, steps)
        return [(value, structure.delay, point)]
    if structure.domain == "z":
        return _minima(task, np.arange(int(structure.delay_max * task.frf.sampling_rate + 1e-9) + 1) / task.frf.sampling_rate, steps)
    step = options.delay_step / top
    count = max(int(np.ceil(structure.delay_max / step)), 1) + 1
    delays = np.linspace(0.0, structure.delay_max, count)
    part = task.frf.frequency <= top * MOST_DELAYS / count
    if count > MOST_DELAYS and 2 * int(part.sum()) > structure.parameters:
        coarse = scan(
            replace(task, frf=task.frf.select(part), plan=plan_for(task.frf.select(part), structure), weight=task.weight[part]), steps, options
        )
        width = options.delay_step / float(task.frf.frequency[part][-1])
        near = [np.abs(delays - delay) <= width for _, delay, _ in coarse[:FOLLOWED]]
        delays = delays[np.any(near, axis=0)]
    return _minima(task, delays, steps)


def _minima(task: Problem, delays: FloatArray, steps: int) -> list[tuple[float, float, Point]]:
    """(cost, delay, point) at the local minima of the cost over some delays, best first."""
    plan, orders = task.plan, (task.structure.numerator_order, task.structure.free_order)

    def at(delay: float) -> tuple[float, float, Point]:
        factor = plan.line_factor * np.exp(-1j * plan.line_omega * delay)
        found = _reweighted(plan.line, factor, task.frf.response, task.weight, *orders, min(steps, SCAN_STEPS))
        return found[0], delay, _point(found[1:], delay)

    found = [at(float(delay)) for delay in delays]
    costs = [item[0] for item in found]
    padded = [np.inf, *costs, np.inf]
    minima = [i for i in range(len(found)) if padded[i + 1] <= padded[i] and padded[i + 1] <= padded[i + 2]]
    return [found[i] for i in sorted(minima, key=lambda i: costs[i])]


@compiled
def _reweighted(
    line: NDArray[np.complex128],
    factor: NDArray[np.complex128],
    data: NDArray[np.complex128],
    weight: NDArray[np.float64],
    n_order: int,
    d_order: int,
    steps: int,
) -> tuple[float, float, NDArray[np.float64], float, NDArray[np.float64], NDArray[np.float64]]:
    """The lowest cost of some linear steps without correction of the data, infinite if none is finite; and the solution of the last step."""
    lines, lowest = line.shape[0], np.inf
    n_weight, d_weight = np.empty(lines, dtype=np.complex128), np.empty(lines, dtype=np.complex128)
    down, largest = np.ones(lines, dtype=np.complex128), 1.0
    for _ in range(steps):
        for i in range(lines):
            now = weight[i] * largest / down[i]
            n_weight[i], d_weight[i] = now * factor[i], now * data[i]
        n_first, n_recurrence, d_first, d_recurrence, solution, up, down = _solved(line, n_weight, d_weight, n_order, d_order)
        total, largest = 0.0, 0.0
        for i in range(lines):
            error = weight[i] * (factor[i] * up[i] / down[i] - data[i])
            total += error.real * error.real + error.imag * error.imag
            largest = max(largest, abs(down[i]))
        if 0.5 * total < lowest:
            lowest = 0.5 * total
    return lowest, n_first, n_recurrence, d_first, d_recurrence, solution


def searched(task: Problem, steps: int, options: FitOptions) -> tuple[Point, float, int]:
    """The estimate of the linear method: best delay of the scan, then a golden-section search around it."""
    candidates = scan(task, steps, options)
    _, delay, start = candidates[0]
    best, lowest, count = reweighted(task, delay, steps, start if steps > 1 else None)
    if not (task.structure.free_delay and options.refine_delay):
        return best, lowest, count
    width = options.delay_step / float(task.frf.frequency[-1])
    low, high = max(delay - width, 0.0), min(delay + width, task.structure.delay_max)
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(48):
        if high - low < 1e-12:
            break
        for trial in (high - ratio * (high - low), low + ratio * (high - low)):
            point, value, more = reweighted(task, trial, steps, best if steps > 1 else None)
            count += more
            if value < lowest:
                best, lowest = point, value
        # keep the part around the best delay
        span = ratio * (high - low)
        low, high = max(best.delay - 0.5 * span, 0.0), min(best.delay + 0.5 * span, task.structure.delay_max)
    return best, lowest, count
