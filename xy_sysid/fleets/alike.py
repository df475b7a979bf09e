"""The wander of a parameter on similar machines, learned from the series of all other axes of a table.

Machines of a fleet wander similarly, but not identically. Therefore the model has two levels. In each candidate the spreads of the axes are
log-normal about one value with one width, and one kind of slowness is usual. The candidates are weighted by how well they explain the series
of all axes. The wander of a new axis is predicted from the weighted candidates. This also learns how similar the machines are: it distinguishes
twenty axes that all spread by 2 % from twenty axes that spread by 0.5 to 8 %.

The weights for an axis come only from the other axes. Its own series is counted once, in its statistic.

Sources: Gelman et al., Bayesian Data Analysis, 3rd ed., ch. 5 (hierarchical models); Robbins, An empirical Bayes approach to statistics (1956).
"""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from xy_sysid.fleets.change import Evidence
from xy_sysid.fleets.wander import SLOW, SPREADS, grid, usual
from xy_sysid.samples.block import FloatArray

WIDTHS = (0.1, 0.3, 0.6, 1.2)  # standard deviation of the logarithm of the axes' spreads
OTHER = 0.1  # probability that an axis has another kind of slowness than most
FEWEST = 3  # recordings; a shorter series carries no information


@functools.cache
def candidates() -> FloatArray:
    """(c, g) log probability of each wander of the grid, for each candidate."""
    every = grid()
    spread = np.log([one.spread for one in every])
    kind = np.array([SLOW.index((one.slow, one.length)) for one in every])
    rows = []
    for middle in np.log(SPREADS):
        for width in WIDTHS:
            for most in range(len(SLOW)):
                near = -0.5 * ((spread - middle) / width) ** 2 + np.log(np.where(kind == most, 1.0 - OTHER, OTHER / (len(SLOW) - 1)))
                rows.append(near - logsumexp(near))
    return np.array(rows)


@functools.cache
def before() -> FloatArray:
    """(c,) log probability of each candidate before any series is seen: the usual wander for a first axis."""
    found = np.log(np.exp(candidates()) @ np.exp(usual()))
    return np.asarray(found - logsumexp(found))


def likelihood(found: Evidence) -> FloatArray:
    """(g,) log likelihood of a series for each wander. A change and no change are equally probable, and so are all starts of the change.

    0 for a series that is too short.
    """
    count = found.none.shape[1]
    if count < FEWEST:
        return np.zeros(len(grid()))
    return np.asarray(np.logaddexp(found.none + found.odd, found.none + found.change - np.log(count - 1))[:, -1])


def learned(every: Sequence[Evidence]) -> FloatArray:
    """(g,) log weights of the grid for a new, similar axis."""
    return _predicted(_explained(every).sum(axis=0)) if len(every) else usual()


def learned_for_each(every: Sequence[Evidence]) -> list[FloatArray]:
    """(g,) log weights of the grid for each of these axes, learned from all others."""
    each = _explained(every)
    return [_predicted(row) for row in each.sum(axis=0) - each] if len(every) > 1 else [usual() for _ in every]


def _explained(every: Sequence[Evidence]) -> FloatArray:
    """(series, c) log likelihood of each series for each candidate."""
    return np.array([logsumexp(candidates() + likelihood(one), axis=1) for one in every])


def _predicted(explained: FloatArray) -> FloatArray:
    """(g,) log weights of the grid, from the log likelihood (c,) of the series for each candidate."""
    log = before() + explained
    return np.asarray(logsumexp((log - logsumexp(log))[:, None] + candidates(), axis=0))
