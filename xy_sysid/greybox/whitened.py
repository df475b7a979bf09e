"""One-step prediction without a filter: the error of a free simulation, predicted from its past by an autoregressive model.

A fair baseline for any one-step prediction, because it also predicts the effects that the model lacks (Ljung, System Identification,
2nd ed., sec. 3.2 and 10.1).
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

ORDER = 60  # number of past samples that predict the next: 30 ms at 2 kHz
SAMPLES = 4  # least number of fitted samples for each of these
RIDGE = 1e-12  # relative to the power, for an exactly predictable error


def whitened_rms(error: FloatArray, held: NDArray[np.bool_], order: int = ORDER) -> float:
    """rms of the one-step error of an autoregressive model on held-out samples, in the unit of ``error``.

    error: (n,) measured minus simulated, evenly sampled; held: (n,) True for held-out samples; the model is fitted to the others
    by least squares. Velocity and position give the same prediction, since the last position is measured. Raises BadInput for bad arrays.
    """
    if error.shape != held.shape or error.ndim != 1:
        raise BadInput("shape of error and held", f"{error.shape} and {held.shape}", "one and the same (n,)", "Give one flag a sample.")
    if not np.all(np.isfinite(error)):
        raise BadInput("error", "not finite", "finite numbers", "Give the error of a simulation that did not diverge.")
    runs, judged = _used(held, order)
    if not enough(held, order):
        raise BadInput(
            "samples to fit and to judge an autoregressive model",
            f"{sum(b - a - order for a, b in runs)} and {int(np.sum(judged))}",
            f"at least {4 * max(order, 1)}, and one, with order >= 1",
            "Record for longer, hold out fewer samples, or lower the order.",
        )
    mean = float(np.mean(error[~held]))
    centred = error - mean
    products = np.zeros((order + 1, order + 1))
    for a, b in runs:
        products += _products(centred[a:b], order)
    ridge = RIDGE * products[0, 0] + 1e-300
    past = np.linalg.solve(products[1:, 1:] + ridge * np.eye(order), products[1:, 0])
    left = scipy.signal.lfilter(np.concatenate(([1.0], -past)), [1.0], centred)
    return float(np.sqrt(np.mean(left[judged] ** 2)))


def enough(held: NDArray[np.bool_], order: int = ORDER) -> bool:
    """True if there are enough samples to fit an autoregressive model and to judge it; held: (n,) True for held-out samples."""
    runs, judged = _used(held, order)
    return order >= 1 and sum(b - a - order for a, b in runs) >= SAMPLES * order and bool(np.any(judged))


def _used(held: NDArray[np.bool_], order: int) -> tuple[list[tuple[int, int]], NDArray[np.bool_]]:
    """Fitted stretches, each longer than the order, and (n,) True for the samples that are judged."""
    judged = held.copy()
    judged[:order] = False
    return [(a, b) for a, b in _runs(~held) if b - a > order], judged


def _runs(wanted: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first, one past the last) of each stretch that is True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wanted, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _products(error: FloatArray, order: int) -> FloatArray:
    """(order + 1, order + 1): sums of e[t - i] e[t - j] over t = order .. end. One row by sums, the rest from the samples that enter and leave."""
    n = error.size
    found = np.empty((order + 1, order + 1))
    found[0] = [error[order:] @ error[order - lag : n - lag] for lag in range(order + 1)]
    found[:, 0] = found[0]
    enters, leaves = error[order - 1 :: -1], error[n - 1 : n - 1 - order : -1]  # at lag 0, 1, ..., order - 1, one sample earlier
    for lag in range(order):
        found[lag + 1, 1:] = found[lag, :-1] + enters[lag] * enters - leaves[lag] * leaves
    return found
