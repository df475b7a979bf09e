"""Non-linear least squares with the structure's weighting, by Gauss-Newton or Levenberg-Marquardt."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.damped import Minimum, minimise
from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.linear import reweighted, scan
from xy_sysid.fitting.problem import Point, Problem, from_transfer_function, problem
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.frf import FrequencyResponse
from xy_sysid.transfer_function import TransferFunction

DEFAULTS = FitOptions()
STARTS = 2  # delays of the scan that are followed to their minimum


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """The minimum that ``start`` leads to, or the best of those that the linear estimators lead to.

    Raises BadInput for too few lines, or a start that is not of the structure.
    """
    return solve(problem(frf, structure), start, options, options.method)


def solve(task: Problem, start: TransferFunction | None, options: FitOptions, name: str) -> Fit:
    """The same for lines already weighted; name: what the method is called in the result."""
    if start is not None:
        point = from_transfer_function(task, start)
        if point is not None:
            return finished(task, minimise(task, point, options), name, "the given model")
    return finished(task, cold(task, options), name, "iterative weighted least squares at the best delays of a scan")


def cold(task: Problem, options: FitOptions) -> Minimum:
    """The best minimum from linear starts at a few delays."""
    best: Minimum | None = None
    for _, delay, start in scan(task, options.reweightings, options)[:STARTS]:
        point, value, _ = reweighted(task, delay, options.reweightings, start)
        found = minimise(task, point, options) if np.isfinite(value) else Minimum(point, value, 0, False, "No finite start.")
        if best is None or found.cost < best.cost:
            best = found
        if best.cost <= 1.5 * float(len(task.frf)) and task.structure.weighting == "sigma":
            break  # as good as the noise allows
    assert best is not None
    return best


def finished(task: Problem, found: Minimum, name: str, start: str) -> Fit:
    """A minimum as a result."""
    point: Point = found.point
    return finish(task, point, name, found.iterations, found.converged, found.reason, start)
