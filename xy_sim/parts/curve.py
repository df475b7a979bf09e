"""A smooth random curve: a variation along the travel or in time, without a visible period or law.

Law: cubic B-spline through KNOTS random heights, one unit apart, periodic; mean 0 and rms 1 over all of it.
Source: de Boor, A Practical Guide to Splines, rev. ed. 2001, ch. IX (uniform cubic B-spline).
"""

from __future__ import annotations

import math

import numpy as np

from xy_sim.inlined import inlined
from xy_sysid.samples.block import FloatArray

KNOTS = 64  # a power of two; a motion covers only a few of them, so the curve does not repeat


def heights(seed: int) -> FloatArray:
    """(KNOTS,) coefficients of the curve of this seed."""
    drawn = np.random.default_rng([20_261, seed]).standard_normal(KNOTS)
    drawn -= drawn.mean()
    fine = np.array([value(drawn, 0, k / 8.0) for k in range(8 * KNOTS)])
    scaled: FloatArray = drawn / np.sqrt(np.mean(fine**2))
    return scaled


@inlined
def value(p: FloatArray, first: int, place: float) -> float:
    """Height at ``place`` (knots); the coefficients begin at ``first`` of ``p``."""
    whole = math.floor(place)
    k, s = int(whole), place - whole
    r = 1.0 - s
    total: float = r * r * r * p[first + ((k - 1) & (KNOTS - 1))] + s * s * s * p[first + ((k + 2) & (KNOTS - 1))]
    total += (4.0 - 6.0 * s * s + 3.0 * s * s * s) * p[first + (k & (KNOTS - 1))]
    total += (4.0 - 6.0 * r * r + 3.0 * r * r * r) * p[first + ((k + 1) & (KNOTS - 1))]
    return total / 6.0


@inlined
def around_one(p: FloatArray, first: int, depth: float, place: float) -> float:
    """A factor around 1: 1 plus ``depth`` times the curve at ``place`` (knots), at least 0.1."""
    return max(1.0 + depth * value(p, first, place), 0.1)
