"""The wander of a parameter on an axis is learned from similar axes, weighted by their similarity."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from xy_sysid.fleets.alike import learned, learned_for_each
from xy_sysid.fleets.change import Evidence, evidence
from xy_sysid.fleets.wander import Series, grid, usual
from xy_sysid.samples.block import FloatArray

COUNT = 16  # recordings of each axis


def seen(spreads: Iterable[float], change: float = 0.0) -> list[Evidence]:
    """Evidence of axes with this scatter; the last half of the recordings may have a change."""
    random, late = np.random.default_rng(17), np.arange(COUNT) >= COUNT // 2
    series = (spread * random.standard_normal(COUNT) + change * late for spread in spreads)
    return [evidence(Series(np.arange(COUNT, dtype=np.float64), value, np.full(COUNT, 0.0005)))[0] for value in series]


def spread_of(weights: FloatArray) -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of the spread."""
    log, share = np.log([one.spread for one in grid()]), np.exp(weights)
    mean = float(share @ log)
    return float(np.exp(mean)), float(np.sqrt(share @ (log - mean) ** 2))


def test_axes_that_are_alike_tell_the_spread_of_the_next_one() -> None:
    """From twelve axes with a scatter of 1 %, that of the thirteenth is predicted within a fifth."""
    middle, width = spread_of(learned(seen([0.01] * 12)))
    assert 0.008 < middle < 0.0125 and width < 0.35


def test_axes_that_differ_leave_it_open() -> None:
    """Some scatter by 0.3 %, others by 3 %: both are possible for the next one."""
    middle, width = spread_of(learned(seen([0.003, 0.03] * 6)))
    assert 0.005 < middle < 0.02 and width > 0.8


def test_axes_that_changed_once_do_not_count_as_restless() -> None:
    """A step of 20 % on each of them is a change, not wander."""
    assert spread_of(learned(seen([0.01] * 8, change=0.2)))[0] < 0.015


def test_an_axis_does_not_tell_its_own_wander() -> None:
    """Its own series already counts in its statistic. A single axis in a table gets the usual wander."""
    every = seen([0.01, 0.01, 0.01, 0.2])
    assert np.allclose(learned_for_each(every)[3], learned(every[:3]))
    assert np.array_equal(learned_for_each(every[:1])[0], usual()) and np.array_equal(learned([]), usual())
