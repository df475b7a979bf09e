"""Is an effect named more often, or less, than before? The same detection as of a change, for yes and no.

An axis that does not change has its effect named with one probability in every recording, which is mostly near 0 or near 1; a change takes it to
another. Both are integrated over a beta distribution, so that the likelihood ratio of each change has a closed form.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaln, logsumexp

from xy_sysid.samples.block import FloatArray

NEARLY_ALWAYS = 0.05  # both parameters of the beta distribution: an unchanged axis is nearly always told the same


def statistic(named: NDArray[np.bool_]) -> FloatArray:
    """(n,) log of Shiryaev and Roberts' statistic after each recording; named: (n,)."""
    return np.array([float(logsumexp(_ratios(named[: n + 1]))) if n else -np.inf for n in range(named.size)])


def after(named: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Number of the last recording before the likeliest change of (n,), and the 95 % interval of that number."""
    log = _ratios(named)
    total = np.cumsum(np.exp(log - logsumexp(log)))
    return int(np.argmax(log)), int(np.searchsorted(total, 0.025)), min(int(np.searchsorted(total, 0.975)), named.size - 2)


def _ratios(named: NDArray[np.bool_]) -> FloatArray:
    """(n - 1,) log likelihood ratio of a change after each recording but the last."""
    yes = np.cumsum(named, dtype=np.int64)[:-1]
    count = np.arange(1, named.size)
    every, rest = int(named.sum()), named.size - count
    parts = _log(yes, count - yes) + _log(every - yes, rest - (every - yes)) - _log(np.array(every), np.array(named.size - every))
    return np.asarray(parts)


def _log(yes: NDArray[np.int64], no: NDArray[np.int64]) -> FloatArray:
    """Log probability of so many yes and no, in the order in which they came."""
    return np.asarray(betaln(NEARLY_ALWAYS + yes, NEARLY_ALWAYS + no) - betaln(NEARLY_ALWAYS, NEARLY_ALWAYS))
