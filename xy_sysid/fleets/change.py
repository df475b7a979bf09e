"""Has a parameter changed, when, and by how much? Bayesian sequential detection of a change in a series of estimates.

Each estimate is level + wander + error. The error is the recording's own, known from its interval. The wander is what temperature, load and
lubrication do between recordings: a Gaussian process with standard deviation tau whose correlation falls as exp(-distance / length). Neither is
known: all of a grid of pairs are weighed by how well they explain the series (and, where there are several machines, all of their series).
A change begins after some recording and takes no time or several recordings; its size is Gaussian, with a standard deviation that is again
one of a grid. For each beginning the likelihood ratio to no change has a closed form (linear Gaussian model, level and size integrated out).

Their sum over all beginnings is the statistic of Shiryaev and Roberts. Without a change it is n after n recordings on average, so a threshold
c is passed once in c recordings or more seldom, whatever the grid: the threshold follows from the rate of false alarms that is allowed, and
nothing is tuned. A single recording that is off (another load, a loose cable) is a hypothesis of its own among those without a change.

Sources: Roberts, A comparison of some control chart procedures, Technometrics 8 (1966); Pollak & Siegmund, Approximations to the expected
sample size of certain sequential tests, Ann. Statist. 3 (1975); Shin, Ramdas & Rinaldo, E-detectors, New England J. Statist. Data Sci. 2 (2023).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from xy_sysid.samples.block import FloatArray

SPREADS = np.geomspace(3e-4, 0.3, 16)  # tau, part of the level
LENGTHS = (0.0, 3.0, 12.0)  # of the correlation of the wander, usual distances between recordings
DURATIONS = (0.0, 5.0, 20.0, 80.0)  # of a change, the same
SIZES = (0.01, 0.03, 0.1, 0.3, 1.0)  # standard deviation of a change, part of the level
ODD = 0.01  # probability that a single recording is off
FEW = 0.1  # alike machines that an even weight of the grid counts as, when it is learned from many
CERTAIN = 600.0  # log of a likelihood ratio beyond which it is all the same
EXACT = 1e-5  # part of the level: no estimate is more exact
LONGEST = 200  # recordings that are looked at together; of longer series the older half is let go


@dataclass(frozen=True, slots=True)
class Series:
    """One parameter of one axis over time, as parts of its level.

    time: (n,) usual distances between recordings, increasing; value, sigma: (n,) estimate and standard error
    """

    time: FloatArray
    value: FloatArray
    sigma: FloatArray

    def after(self, place: int) -> Series:
        """From that recording on."""
        return Series(self.time[place:], self.value[place:], self.sigma[place:])

    def until(self, place: int) -> Series:
        """Before that recording."""
        return Series(self.time[:place], self.value[:place], self.sigma[:place])


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a series says, for each pair of spread and length (g of them) after each recording (n).

    none: (g, n) log likelihood without a change; odd: (g, n) log factor by which single recordings that are off raise it
    change: (g, n) log of the sum of the likelihood ratios of all changes
    """

    none: FloatArray
    odd: FloatArray
    change: FloatArray


@dataclass(frozen=True, slots=True)
class Change:
    """A change of a series.

    after:    number of the last recording before it; first, last: 95 % interval of that number
    duration: recordings' distances that it took; size, sigma: part of the level, and its standard deviation
    declared: number of the recording with which it was certain enough; statistic: log of Shiryaev and Roberts' then and with all recordings
    """

    after: int
    first: int
    last: int
    duration: float
    size: float
    sigma: float
    declared: int
    statistic: float


def grid() -> list[tuple[float, float]]:
    """All pairs of spread and length."""
    return [(float(spread), length) for length in LENGTHS for spread in SPREADS]


def even() -> FloatArray:
    """(g,) log weights of the grid when nothing is known."""
    return np.full(len(grid()), -np.log(len(grid())))


def evidence(series: Series) -> Evidence:
    """The evidence of a series of any length below LONGEST."""
    n, pairs = series.value.size, grid()
    shapes = _shapes(series.time)
    begun = np.cumsum(shapes != 0.0, axis=0).T > 0
    none, odd, change = (np.full((len(pairs), n), -np.inf) for _ in range(3))
    for row, pair in enumerate(pairs):
        parts = _whitened(series, pair, shapes)
        none[row] = parts.none
        ratios = parts.ratios(begun)
        odd[row] = np.log1p(ODD * ratios[:n].sum(axis=0))
        change[row, 1:] = np.log(ratios[n:, 1:].sum(axis=0) / len(DURATIONS))
    return Evidence(none, odd, change)


def statistic(found: Evidence, weights: FloatArray) -> FloatArray:
    """(n,) log of Shiryaev and Roberts' statistic after each recording."""
    none = weights[:, None] + found.none
    return np.asarray(logsumexp(none + found.change, axis=0) - logsumexp(none + found.odd, axis=0))


def learned(every: Iterable[Evidence], rounds: int = 5) -> FloatArray:
    """(g,) log weights of the grid from many series of alike machines: each has a say, whether or not it changed."""
    totals = [np.logaddexp(one.none + one.odd, one.none + one.change)[:, -1] for one in every if one.none.shape[1] > 2]
    weights = even()
    for _ in range(rounds if totals else 0):
        shares = sum((np.exp(weights + total - logsumexp(weights + total)) for total in totals), FEW * np.exp(even()))
        weights = np.log(shares / shares.sum())
    return np.asarray(weights)


def spread(series: Series, weights: FloatArray) -> tuple[float, FloatArray]:
    """Standard deviation of the wander of a series without a change, and (g,) how likely each pair of the grid is."""
    none = np.array([_whitened(series, pair, np.zeros((series.value.size, 0))).none[-1] for pair in grid()])
    share = np.exp(weights + none - logsumexp(weights + none))
    return float(np.sqrt(sum(part * pair[0] ** 2 for part, pair in zip(share, grid(), strict=True)))), share


def changes(series: Series, weights: FloatArray, threshold: float, known: Evidence | None = None) -> tuple[Change, ...]:
    """Every change of a series, in order; threshold: log of the statistic from which a change is declared; known: its evidence, if it is."""
    if known is not None and series.value.size <= LONGEST and not np.any(statistic(known, weights) >= threshold):
        return ()
    found: list[Change] = []
    start = 0
    while series.value.size - start > 2:
        part = series.after(start).until(LONGEST)
        declared = _passed(part, weights, threshold)
        if declared is not None:
            change = _located(part, weights)
            if _passed(_without(part, change), weights, threshold) is not None:  # there is more than one
                change = _located(part.until(declared + 1), weights)
            found.append(_moved(change, start, start + declared))
            ended = int(np.searchsorted(part.time, part.time[change.after] + change.duration))
            start += max(ended, change.after + 1)  # what follows is compared with what came after the change
        elif series.value.size - start > LONGEST:
            start += LONGEST // 2
        else:
            break
    return tuple(found)


def _passed(series: Series, weights: FloatArray, threshold: float) -> int | None:
    """The recording with which a change is declared."""
    passed = np.flatnonzero(statistic(evidence(series), weights) >= threshold)
    return int(passed[0]) if passed.size else None


def _without(series: Series, change: Change) -> Series:
    shape = _shape(series.time, change.after, change.duration)
    return Series(series.time, series.value - change.size * shape, series.sigma)


def _moved(change: Change, by: int, declared: int) -> Change:
    """The same in numbers of a longer series."""
    return replace(change, after=change.after + by, first=change.first + by, last=change.last + by, declared=declared)


def _located(series: Series, weights: FloatArray) -> Change:
    """When the one change of a series was, and by how much."""
    n = series.value.size
    shapes = _shapes(series.time)
    log, mean, power = [], [], []
    for weight, pair in zip(weights, grid(), strict=True):
        parts = _whitened(series, pair, shapes)
        for size in SIZES:
            information, score = parts.information[n:, -1], parts.score[n:, -1]
            shrunk = size**2 / (1.0 + size**2 * information)
            log.append(weight + parts.none[-1] - 0.5 * np.log1p(size**2 * information) + 0.5 * shrunk * score**2)
            mean.append(shrunk * score)
            power.append(shrunk)
    share = np.exp(np.array(log) - logsumexp(log))
    size = float(np.sum(share * np.array(mean)))
    variance = float(np.sum(share * (np.array(power) + np.square(mean)))) - size**2
    each = share.sum(axis=0).reshape(len(DURATIONS), n - 1)
    total = np.cumsum(each.sum(axis=0))
    after = int(np.argmax(each.sum(axis=0)))
    return Change(
        after=after,
        first=int(np.searchsorted(total, 0.025)),
        last=min(int(np.searchsorted(total, 0.975)), n - 2),
        duration=DURATIONS[int(np.argmax(each[:, after]))],
        size=size,
        sigma=float(np.sqrt(max(variance, 0.0))),
        declared=n - 1,
        statistic=float(statistic(evidence(series), weights)[-1]),
    )


@dataclass(frozen=True, slots=True)
class _Whitened:
    """none: (n,) log likelihood without a change; information, score: (shapes, n) of the size of each shape after each recording."""

    none: FloatArray
    information: FloatArray
    score: FloatArray

    def ratios(self, begun: NDArray[np.bool_]) -> FloatArray:
        """(shapes, n) likelihood ratio of each shape, mean over sizes, 0 before it has begun."""
        total = np.zeros_like(self.score)
        for size in SIZES:
            told = 1.0 + size**2 * self.information
            total += np.exp(np.minimum(0.5 * size**2 * self.score**2 / told, CERTAIN)) / np.sqrt(told)
        return np.where(begun, total / len(SIZES), 0.0)


def _whitened(series: Series, pair: tuple[float, float], shapes: FloatArray) -> _Whitened:
    """What each shape (n, k) explains after each recording, for one spread and length.

    The Cholesky factor of the first recordings is the corner of that of all, so that running sums give the answers after each.
    """
    tau, length = pair
    distance = np.abs(series.time[:, None] - series.time[None, :])
    together = np.exp(-distance / length) if length else (distance == 0.0).astype(np.float64)
    factor = np.linalg.cholesky(tau**2 * together + np.diag(series.sigma**2 + EXACT**2))
    columns = np.column_stack((np.ones_like(series.value), series.value - series.value[0], shapes))
    white = solve_triangular(factor, columns, lower=True, check_finite=False)
    one, value, shape = white[:, :1], white[:, 1:2], white[:, 2:]
    ones, values, both = (np.cumsum(part, axis=0) for part in (one * one, value * value, one * value))
    across, along = np.cumsum(one * shape, axis=0), np.cumsum(value * shape, axis=0)
    information = np.maximum(np.cumsum(shape * shape, axis=0) - across**2 / ones, 0.0)
    score = along - across * both / ones
    logs = np.cumsum(np.log(np.diag(factor)))
    none = -logs - 0.5 * (np.log(ones) + values - both**2 / ones)[:, 0]
    return _Whitened(none, information.T, score.T)


def _shapes(time: FloatArray) -> FloatArray:
    """(n, n + (n - 1) durations): each single recording that is off, and each change, by duration and by the recording after which it begins."""
    changed = [_shape(time, after, duration) for duration in DURATIONS for after in range(time.size - 1)]
    return np.column_stack((np.eye(time.size), *changed))


def _shape(time: FloatArray, after: int, duration: float) -> FloatArray:
    """(n,) from 0 to 1: a change that begins after a recording."""
    since = time - time[after]
    return np.clip(since / duration, 0.0, 1.0) if duration else np.asarray(since > 0.0, dtype=np.float64)
