"""Linear least squares for N and D, plain and re-weighted by the last denominator.

Levy, "Complex-curve fitting", IRE Trans. 1959; Sanathanan & Koerner, IEEE Trans. Automatic Control 8, 1963. Hold, window
and delay enter as a correction of the data: the difference that they make in the prediction of the last model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from xy_sysid.fitting.basis import basis
from xy_sysid.fitting.plan import plan_for
from xy_sysid.fitting.problem import Point, Problem, cost, rational, response
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

SCAN_STEPS = 4  # reweightings at each delay of the scan: enough to rank delays
MOST_DELAYS = 400  # of one scan; with more, lower lines select a range first
FOLLOWED = 6  # best delays of the lower lines around which the fine grid is searched


def linear_step(task: Problem, delay: float, last: Point | None, correct: bool) -> Point:
    """One linear fit at a delay, weighted by the last denominator; the first one (last=None) is Levy's."""
    line, structure = task.plan.line, task.structure
    factor = task.plan.line_factor * np.exp(-1j * task.plan.line_omega * delay)
    data = task.frf.response
    weight: ComplexArray = task.weight.astype(np.complex128)
    if last is not None:
        up, down = rational(task, last)
        weight = weight / (down / np.max(np.abs(down)))
        if correct:
            data = data - (response(task, last) - factor * up / down)
    n_weight, d_weight = weight * factor, weight * data
    numerator = basis(line, np.abs(n_weight), structure.numerator_order)
    denominator = basis(line, np.abs(d_weight), structure.free_order)
    left = numerator.values(line) * n_weight[:, None]
    right = denominator.values(line) * d_weight[:, None]
    table = np.concatenate((left, -right[:, :-1], right[:, -1:]), axis=1)
    upper: FloatArray = np.asarray(np.linalg.qr(np.concatenate((table.real, table.imag)), mode="r"))
    size = upper.shape[1] - 1
    if not np.all(np.isfinite(upper)):
        upper = np.zeros_like(upper)  # not solvable: a point whose cost is infinite or worse than any other
    solution: FloatArray = np.asarray(np.linalg.lstsq(upper[:size, :size], upper[:size, size], rcond=1e-14)[0], dtype=np.float64)
    split = structure.numerator_order + 1
    return Point(numerator=numerator, denominator=denominator, b=solution[:split], a=np.append(solution[split:], 1.0), delay=delay)


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
    found: list[tuple[float, float, Point]] = []
    for delay in delays:
        point = linear_step(task, float(delay), None, False)
        lowest = _simple_cost(task, point)
        for _ in range(min(steps, SCAN_STEPS) - 1):
            point = linear_step(task, float(delay), point, False)
            lowest = min(lowest, _simple_cost(task, point))
        found.append((lowest if np.isfinite(lowest) else np.inf, float(delay), point))
    costs = [item[0] for item in found]
    padded = [np.inf, *costs, np.inf]
    minima = [i for i in range(len(found)) if padded[i + 1] <= padded[i] and padded[i + 1] <= padded[i + 2]]
    return [found[i] for i in sorted(minima, key=lambda i: costs[i])]


def _simple_cost(task: Problem, at: Point) -> float:
    up, down = rational(task, at)
    return cost(task, task.plan.line_factor * np.exp(-1j * task.plan.line_omega * at.delay) * up / down)


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
