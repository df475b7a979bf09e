"""How sure a fit is: covariance of the parameters, and the cost that noise alone lets expect.

Errors of neighbouring lines are correlated (window, overlap), so the sandwich (J'J)^-1 J' S J (J'J)^-1 with S the covariance
of the weighted errors (Pintelon & Schoukens, System Identification, 2nd ed., 9.11).
"""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.damped import triangle
from xy_sysid.fitting.problem import Problem
from xy_sysid.stream import FloatArray

RANK = 1e-13  # a direction seen less than this part of the best one is not estimated


def covariance(task: Problem, table: FloatArray) -> tuple[FloatArray, float, float]:
    """((p, p) covariance of b, a, delay, expected cost, its standard deviation); NaN without sigma.

    table: (p + 1, 2 m) as ``damped.weighted`` gives it.
    """
    size = table.shape[0] - 1
    if task.sigma is None:
        return np.full((size, size), np.nan), float("nan"), float("nan")
    upper = triangle(table)[:size, :size]
    scale = np.sqrt(np.sum(upper**2, axis=0))
    scale[~(scale > 0)] = 1.0
    _, values, right = np.linalg.svd(upper / scale)
    keep = values > RANK * values[0]
    bread = (right[keep].T / values[keep] ** 2) @ right[keep]
    error = task.weight * task.sigma
    meat = 0.5 * _meat(task, table[:-1].reshape(size, 2, -1) * (error / scale[:, None])[:, None, :])
    expected = 0.5 * (float(np.sum(error**2)) - float(np.trace(bread @ meat)))
    squares = task.frf.line_correlation[1:] ** 2
    spread = float(np.sum(error**4)) * (1.0 + 2.0 * float(np.sum(squares)))
    freedom = 2.0 * (task.frf.averages - 1.0)
    if task.structure.weighting == "sigma" and freedom > 4.5:  # sigma is itself estimated: |error|^2 / sigma^2 is F(2, freedom)
        expected *= freedom / (freedom - 2.0)
        spread *= freedom**3 / ((freedom - 2.0) ** 2 * (freedom - 4.0))
    return (bread @ meat @ bread) / np.outer(scale, scale), expected, 0.5 * float(np.sqrt(spread))


def _meat(task: Problem, rows: FloatArray) -> FloatArray:
    """(p, p) sum over pairs of lines of their errors' correlation and Re(conj(J_i) J_j); rows: (p, 2, m) J times the errors' size."""
    frf = task.frf
    correlation = frf.line_correlation
    if correlation.size > 1:
        place = np.rint(frf.frequency / frf.resolution).astype(np.int64)
        place -= place[0]
        if int(place[-1]) + 1 > place.size:  # lines left out: zeros in their place
            full = np.zeros((*rows.shape[:2], int(place[-1]) + 1))
            full[:, :, place] = rows
            rows = full
    total = _product(rows, rows) * correlation[0]
    for k in range(1, min(correlation.size, rows.shape[2])):
        if correlation[k] != 0.0:
            part = _product(rows[:, :, k:], rows[:, :, :-k])
            total += correlation[k] * (part + part.T)
    return np.asarray(total)


def _product(left: FloatArray, right: FloatArray) -> FloatArray:
    return np.asarray(left[:, 0] @ right[:, 0].T + left[:, 1] @ right[:, 1].T)
