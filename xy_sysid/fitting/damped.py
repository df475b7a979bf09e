"""Gauss-Newton and Levenberg-Marquardt on the weighted errors, by orthogonal factors, never by normal equations.

Damping as in nllsfdi: lambda from 0.01, halved on success, times 10 on failure; columns scaled, and the damped step found by
rotations of the triangular factor (More, "The Levenberg-Marquardt algorithm", 1978).
"""

from __future__ import annotations

from dataclasses import dataclass

from xy_sysid.fitting.problem import Point, Problem, model
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.stream import FloatArray

LARGEST_DAMPING = 1e12
ROUNDING = 1e-26  # a cost below this part of the data's own is zero in double precision
NEAR_ROUNDING = 1e-20  # below this part, a step that fails is blamed on rounding
RANK = 1e-13  # a direction whose factor is below this part of the largest is left where it is


@dataclass(frozen=True, slots=True)
class Minimum:
    """Where a minimisation ended, and why; table: as ``weighted`` gives it there, and upper: (p + 1, p + 1) its factor R."""

    point: Point
    cost: float
    iterations: int
    converged: bool
    reason: str
    table: FloatArray
    upper: FloatArray


def weighted(task: Problem, at: Point) -> FloatArray:
    """(p + 1, 2 m): weighted derivatives to b, a[:-1] and, if it is free, the delay; last the weighted error; real, then imaginary."""
    return _table(task, model(task, at).evaluated, at)


def minimise(task: Problem, start: Point, options: FitOptions) -> Minimum:
    """The nearest minimum of half the sum of squared weighted errors; ``start`` in bases of its own (``rebased``)."""
