"""The wander of a parameter without a change: a grid of wanders, and the likelihood of a series for each.

A wander is a Gaussian process. Its standard deviation is a fraction of the level, and a part of its variance is slow. A series divided by the
Cholesky factor of its covariance is white; then a change is a regression (the equations are in ``change``).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

SPREADS = np.geomspace(3e-4, 0.3, 24)  # tau, fraction of the level: each a third larger than the one before
SLOW = ((0.0, 1.0), *((part, length) for part in (0.3, 0.7, 1.0) for length in (3.0, 12.0)))  # slow part of tau^2, and its correlation length
USUAL = 0.03  # spread between recordings of an unchanged axis: scatter of the friction torque of ball screws, the least stable parameter
SIZES = (0.01, 0.04, 0.16, 0.64)  # standard deviation of a change, part of the level
CERTAIN = 600.0  # log likelihood ratio above which differences do not matter
EXACT = 1e-5  # fraction of the level: smallest assumed error of an estimate


@dataclass(frozen=True, slots=True)
class Series:
    """One parameter of one axis over time, as fractions of its level.

    time: (n,) usual distances between recordings, increasing; value, sigma: (n,) estimate and standard error
    """

    time: FloatArray
    value: FloatArray
    sigma: FloatArray

    def after(self, place: int) -> Series:
        """The series from that recording on."""
        return Series(self.time[place:], self.value[place:], self.sigma[place:])

    def until(self, place: int) -> Series:
        """The series before that recording."""
        return Series(self.time[:place], self.value[:place], self.sigma[:place])


@dataclass(frozen=True, slots=True)
class Wander:
    """spread: tau, fraction of the level; slow: fraction of tau^2 that is correlated between recordings, over ``length`` usual distances."""

    spread: float
    slow: float
    length: float


@functools.cache
def grid() -> tuple[Wander, ...]:
    """Every wander of the grid."""
    return tuple(Wander(float(spread), part, length) for part, length in SLOW for spread in SPREADS)


@functools.cache
def usual() -> FloatArray:
    """(g,) log weights of the grid without other knowledge: a half-normal distribution of the spread, uniform in the rest."""
    log = np.array([-0.5 * (one.spread / USUAL) ** 2 for one in grid()])
    return np.asarray(log - logsumexp(log))


@dataclass(frozen=True, slots=True)
class Whitened:
    """A series and shapes, divided by the factor of the covariance of one wander.

    none: (n,) log likelihood without a change after each recording; one, value: (n,) a constant and the series; shape: (n, shapes)
    """

    none: FloatArray
    one: FloatArray
    value: FloatArray
    shape: FloatArray

    def ratios(self, begun: NDArray[np.int64]) -> FloatArray:
        """(shapes, n) likelihood ratio of each shape after each recording, averaged over sizes; 0 before its start.

        begun: (shapes,) first recording in which a shape is not 0
        """
        return _ratios(self.one, self.value, np.ascontiguousarray(self.shape.T), begun, np.array(SIZES))

    def sizes(self) -> tuple[FloatArray, FloatArray]:
        """(shapes,) information on the size of each shape, and its score: their ratio is the maximum-likelihood size."""
        across, ones = self.one @ self.shape, float(self.one @ self.one)
        information = np.maximum(np.sum(self.shape**2, axis=0) - across**2 / ones, 0.0)
        return information, self.value @ self.shape - across * float(self.one @ self.value) / ones


@compiled
def _ratios(one: FloatArray, value: FloatArray, shapes: FloatArray, begun: NDArray[np.int64], sizes: FloatArray) -> FloatArray:
    """As ``Whitened.ratios``; shapes: (shapes, n)."""
    found = np.zeros(shapes.shape)
    ones, both = np.cumsum(one * one), np.cumsum(one * value)
    for row in range(shapes.shape[0]):
        square = across = along = 0.0
        for place in range(begun[row], shapes.shape[1]):
            white = shapes[row, place]
            square += white * white
            across += one[place] * white
            along += value[place] * white
            information = max(square - across**2 / ones[place], 0.0)
            score = along - across * both[place] / ones[place]
            for size in sizes:
                told = 1.0 + size**2 * information
                found[row, place] += np.exp(min(0.5 * (size * score) ** 2 / told, CERTAIN)) / np.sqrt(told)
            found[row, place] /= sizes.size
    return found


def whitened(series: Series, wander: Wander, shapes: FloatArray) -> Whitened:
    """The series and shapes (n, k) for one wander."""
    distance = np.abs(series.time[:, None] - series.time[None, :])
    slow = wander.slow * np.exp(-distance / wander.length)
    own = np.diag(wander.spread**2 * (1.0 - wander.slow) + series.sigma**2 + EXACT**2)
    return divided(series.value, wander.spread**2 * slow + own, shapes)


def divided(series: FloatArray, covariance: FloatArray, shapes: FloatArray) -> Whitened:
    """A series (n,) and shapes (n, k), whitened with one covariance (n, n).

    The Cholesky factor of the first recordings is the leading block of the full one, so that running sums give the results after each.
    """
    factor = np.linalg.cholesky(covariance)
    columns = np.column_stack((np.ones_like(series), series - series[0], shapes))
    white = solve_triangular(factor, columns, lower=True, check_finite=False)
    one, value = np.ascontiguousarray(white[:, 0]), np.ascontiguousarray(white[:, 1])
    ones, values, both = (np.cumsum(part) for part in (one * one, value * value, one * value))
    none = -np.cumsum(np.log(np.diag(factor))) - 0.5 * (np.log(ones) + values - both**2 / ones)
    return Whitened(none, one, value, white[:, 2:])
