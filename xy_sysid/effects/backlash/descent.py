"""Levenberg-Marquardt within bounds, for errors that come with their derivatives (Levenberg 1944, Marquardt 1963)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.effects._contract import in_time
from xy_sysid.samples.block import FloatArray

Errors = Callable[[FloatArray, bool], tuple[FloatArray, FloatArray]]
FARTHEST = 8.0  # units that a step may go at most, in each direction: what is hardly seen must not hold up the rest
STEP = 1e-2  # units, for differences
STUCK = 1e2  # damping from which a direction is no good
RESCUES = 2  # times that differences are taken


@dataclass(frozen=True, slots=True)
class Found:
    """part: (k,) coordinates; cost: mean square of the errors there; normal: (k, k) slopes' products over the samples."""

    part: FloatArray
    cost: float
    normal: FloatArray


@dataclass(frozen=True, slots=True)
class Patience:
    """most: steps; enough: relative fall of the cost below which it ends; late: then it ends after the step in hand."""

    most: int
    enough: float
    late: Callable[[], bool] = in_time


def descend(errors: Errors, start: FloatArray, low: FloatArray, high: FloatArray, patience: Patience) -> Found:
    """The coordinates that make the errors least, from a start.

    errors: coordinates, and whether derivatives are wanted -> (n,) and (n, k). Derivatives may be inexact: where no step along them
    helps, differences are taken instead.
    """
    part = np.clip(start, low, high)
    error, slopes = errors(part, True)
    cost, damping, rescues = float(error @ error), 1e-2, RESCUES
    normal, slope, fresh = slopes.T @ slopes, slopes.T @ error, True
    for _ in range(patience.most):
        if patience.late():
            break
        step = _step(normal, slope, damping, ((part <= low) & (slope > 0.0)) | ((part >= high) & (slope < 0.0)))
        trial = np.clip(part + step, low, high)
        then, theirs = errors(trial, fresh)
        new = float(then @ then)
        if new < cost:
            if not fresh:
                then, theirs = errors(trial, True)
            fall, part, error, cost = (cost - new) / cost, trial, then, new
            normal, slope, damping, fresh = theirs.T @ theirs, theirs.T @ then, max(damping * 0.2, 1e-7), True
            if fall < patience.enough:
                break
        elif damping < STUCK:
            damping, fresh = damping * 8.0, False
        elif rescues:
            slopes = _differences(errors, part, error, high)
            normal, slope, damping, rescues = slopes.T @ slopes, slopes.T @ error, 1e-2, rescues - 1
        else:
            break
    return Found(part, cost / error.size, normal)


def _step(normal: FloatArray, slope: FloatArray, damping: float, fixed: NDArray[np.bool_]) -> FloatArray:
    """(k,) of the damped normal equations; what is fixed stays."""
    free = ~fixed
    size = np.diag(normal)[free]
    inside = normal[np.ix_(free, free)] + damping * np.diag(np.maximum(size, 1e-9 * float(np.max(size, initial=0.0)) + 1e-300))
    step = np.zeros(slope.size)
    step[free] = -np.linalg.lstsq(inside, slope[free], rcond=None)[0]
    return np.clip(step, -FARTHEST, FARTHEST)


def _differences(errors: Errors, part: FloatArray, error: FloatArray, high: FloatArray) -> FloatArray:
    """(n, k) derivatives."""
    slopes = np.empty((error.size, part.size))
    for k in range(part.size):
        moved = part.copy()
        moved[k] += STEP if part[k] + STEP <= high[k] else -STEP
        slopes[:, k] = (errors(moved, False)[0] - error) / (moved[k] - part[k])
    return slopes
