"""Non-linear least squares with the structure's weighting, by Gauss-Newton or Levenberg-Marquardt."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from xy_sysid.fitting.damped import Minimum, minimise
from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.linear import linear_step, reweighted, scan
from xy_sysid.fitting.plan import PlanKey
from xy_sysid.fitting.problem import Point, Problem, from_transfer_function, in_bases, problem, rational, rebased
from xy_sysid.fitting.result import Ended, Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()
MOST_STARTS = 4  # delays of the scan whose minima are computed if no fit is consistent with the noise


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """The minimum from ``start``, or without one the best minimum from the linear estimators.

    A start with another structure is ignored. Raises BadInput for too few lines.
    """
    return solve(problem(frf, structure), start, options, options.method)


def solve(task: Problem, start: TransferFunction | None, options: FitOptions, name: str) -> Fit:
    """The minimum for lines that are already weighted; name: of the method in the result."""
    if start is not None:
        point = from_transfer_function(task, start)
        if point is not None:
            return finished(task, minimise(task, point, options), name, "the given model")
    return finished(task, cold(task, options), name, "iterative weighted least squares at the best delays of a scan")


def cold(task: Problem, options: FitOptions) -> Minimum:
    """The best minimum from several starts, the most likely first; the search ends when noise explains the cost.

    First the best delay of a scan. Then the delay of a rigid axis, with a fit of the full order under relative weights: weights of 1 / sigma
    can keep linear steps in a wrong minimum if a pole and a zero are close. Then the next delays of the scan.
    """
    best: Minimum | None = None
    scanned = scan(task, options.reweightings, options)
    for start in (scanned[0], None, *scanned[1:MOST_STARTS]):
        found = _grown(task, options) if start is None else _followed(task, start[1], start[2], options)
        if best is None or (found.cost < best.cost and (found.converged or not best.converged)):
            best = found
        if best.cost <= 1.5 * float(len(task.frf)) and task.structure.weighting == "sigma":
            break  # consistent with the noise
    assert best is not None
    mirrored = _mirrored(task, best.point)
    found = minimise(task, mirrored, options) if mirrored is not None else best
    return found if found.cost < best.cost and (found.converged or not best.converged) else best


def _mirrored(task: Problem, at: Point) -> Point | None:
    """The point with unstable poles mirrored to stable ones; None if there are none.

    A fast pole has the effect of a lag of 1 / |pole|, or of a lead in the right half plane, which the delay can compensate.
    Therefore a fit may end with an unstable pole and a delay that is too long by 2 / pole.
    """
    poles = at.denominator.roots(at.a)
    wrong = poles[poles.real > 0]
    if task.structure.domain != "s" or not task.structure.free_delay or not wrong.size:
        return None
    line = task.plan.line[:, None]
    up, down = rational(task, at)
    down = down * np.prod((line + wrong.conj()) / (line - wrong), axis=1)
    up = up * float(np.prod(wrong.conj() / -wrong).real)  # keep the gain
    delay = max(at.delay - float(np.sum(2.0 / wrong).real) / task.plan.scale, 0.0)
    return in_bases(task, up, down, delay, task.weight * np.abs(task.plan.line_factor / down))


def _followed(task: Problem, delay: float, start: Point, options: FitOptions) -> Minimum:
    point, _, _ = reweighted(task, delay, options.reweightings, start)
    return minimise(task, rebased(task, point), options)


@dataclass(frozen=True, slots=True)
class _Rigid:
    """Everything that the delay of a rigid axis depends on, as a cache key; ``frf`` is described by lines and response."""

    structure: Structure
    options: FitOptions
    lines: PlanKey
    response: bytes
    frf: FrequencyResponse = field(compare=False)


@lru_cache(maxsize=8)
def _rigid_delay(asked: _Rigid) -> float:
    """Delay of a rigid axis, s; cached, as a search for the orders needs it for each of them."""
    task = problem(asked.frf, asked.structure)
    _, first, start = scan(task, asked.options.reweightings, asked.options)[0]
    return _followed(task, first, start, asked.options).point.delay


def _grown(task: Problem, options: FitOptions) -> Minimum:
    """The minimum from a start with the delay of a rigid axis."""
    relative = replace(task.structure, weighting="relative")
    rigid = replace(relative, numerator_order=0, denominator_order=min(relative.integrators + 1, relative.denominator_order))
    delay = _rigid_delay(
        _Rigid(structure=rigid, options=options, lines=PlanKey.of(task.frf, rigid), response=task.frf.response.tobytes(), frf=task.frf)
    )
    full = problem(task.frf, relative)
    better = _followed(full, delay, linear_step(full, delay, None, False), options).point
    up, down = rational(task, better)
    factor = task.weight * np.abs(task.plan.line_factor / down)
    return minimise(task, in_bases(task, up, down, better.delay, factor), options)


def finished(task: Problem, found: Minimum, name: str, start: str) -> Fit:
    """A minimum as a result."""
    return finish(task, found.point, name, Ended(found.iterations, found.converged, found.reason), start, found.table)
