"""Is an effect named more or less often than before? The detection of ``change``, for yes and no.

In an axis that does not change, an effect is named with a constant probability. A change gives another probability. Both come from a
symmetric beta distribution, so that the likelihood ratio of each change has a closed form. The distribution's parameter says how rarely the
answer alternates on an unchanged axis. It is not known: a few values are weighted by how well they explain all axes of the table.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaln, logsumexp

from xy_sysid.samples.block import FloatArray

Named = NDArray[np.bool_]
OFTEN = np.array([0.001, 0.01, 0.1, 1.0])  # parameter of the beta distribution: 0.001 almost never alternates, 1 makes any probability equally likely


def learned(every: Iterable[Named]) -> FloatArray:
    """Log weights of ``OFTEN``, from whether effects were named (n,) on all axes, with or without a change."""
    total = np.zeros(OFTEN.size)
    for named in every:
        if named.size > 1:
            total += np.logaddexp(_unchanged(named), logsumexp(_changed(named), axis=1) - np.log(named.size - 1))
    return np.asarray(total - logsumexp(total))


def statistic(named: Named, weights: FloatArray) -> FloatArray:
    """(n,) log of the Shiryaev-Roberts statistic after each recording; named: (n,)."""
    found = np.full(named.size, -np.inf)
    for count in range(2, named.size + 1):
        part = named[:count]
        changed = weights + logsumexp(_changed(part), axis=1)
        found[count - 1] = logsumexp(changed) - logsumexp(weights + _unchanged(part))
    return found


def after(named: Named, weights: FloatArray) -> tuple[int, int, int]:
    """Index of the last recording before the likeliest change of (n,), and the 95 % interval of that index."""
    log = logsumexp(weights[:, None] + _changed(named), axis=0)
    total = np.cumsum(np.exp(log - logsumexp(log)))
    return int(np.argmax(log)), int(np.searchsorted(total, 0.025)), min(int(np.searchsorted(total, 0.975)), named.size - 2)


def _unchanged(named: Named) -> FloatArray:
    """(parameters,) log probability without a change."""
    return np.asarray(_of_each(np.array([np.count_nonzero(named)]), np.array([named.size]))[:, 0])


def _changed(named: Named) -> FloatArray:
    """(parameters, n - 1) log probability with a change after each recording but the last."""
    yes, count = np.cumsum(named, dtype=np.int64)[:-1], np.arange(1, named.size)
    return _of_each(yes, count) + _of_each(np.count_nonzero(named) - yes, named.size - count)


def _of_each(yes: NDArray[np.int64], count: NDArray[np.int64]) -> FloatArray:
    """(parameters, k) log probability of ``yes`` positive answers in ``count`` recordings, in their given order."""
    a = OFTEN[:, None]
    return np.asarray(betaln(a + yes, a + count - yes) - betaln(a, a))
