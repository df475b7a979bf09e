"""Has a parameter changed, when, and by how much? Bayesian sequential detection of a change in a series of estimates.

Each estimate is level + wander + error. The error is the recording's own, known from its interval. The wander is what temperature, load and
lubrication do between recordings: a Gaussian process with standard deviation tau, a part of which is slow: its correlation falls as
exp(-distance / length). None of this is known, so all wanders of a grid are weighed by how well they explain the series, and the series of all
other axes of the table. A change begins after some recording and takes no time or several recordings. Its size is Gaussian, with a standard
deviation that is again one of a grid. For each beginning the likelihood ratio to no change has a closed form: the model is linear and Gaussian,
and level and size are integrated out.

The sum of the ratios over all beginnings is the statistic of Shiryaev and Roberts. Without a change it is n after n recordings, on average over
the grid. So a threshold c is passed at most once in c recordings: it follows from the rate of false alarms that is allowed. One recording that
is off, or two in a row (another load, a loose cable), belong to no change: so it takes a third recording to declare a change with most rates.

Sources: Roberts, A comparison of some control chart procedures, Technometrics 8 (1966); Pollak & Siegmund, Approximations to the expected
sample size of certain sequential tests, Ann. Statist. 3 (1975); Shin, Ramdas & Rinaldo, E-detectors, New England J. Statist. Data Sci. 2 (2023).
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from xy_sysid.samples.block import FloatArray

SPREADS = np.geomspace(3e-4, 0.3, 14)  # tau, part of the level
SLOW = ((0.0, 1.0), *((part, length) for part in (0.3, 0.7, 1.0) for length in (3.0, 12.0)))  # part of tau^2, and length, of what is slow
DURATIONS = (0.0, 5.0, 20.0, 80.0)  # of a change, usual distances between recordings
SIZES = (0.01, 0.04, 0.16, 0.64)  # standard deviation of a change, part of the level
ODD = 0.01  # probability that a recording is off; that the next one is off, too, is as probable again
SURE = 0.99  # probability from which a recording counts as off once and for all
UNLIMITED = 1.0  # standard error, part of the level, of what is off
USUAL = 0.03  # spread between recordings of an unchanged axis: scatter of the friction torque of ball screws, the most lively parameter
FEW = 0.1  # alike machines that these weights count as, when they are learned from many
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
class Wander:
    """spread: tau, part of the level; slow: part of tau^2 that is correlated from one recording to the next, over ``length`` usual distances."""

    spread: float
    slow: float
    length: float


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a series says, for each wander of the grid (g of them) after each recording (n).

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


@functools.cache
def grid() -> tuple[Wander, ...]:
    """Every wander that is weighed."""
    return tuple(Wander(float(spread), part, length) for part, length in SLOW for spread in SPREADS)


@functools.cache
def usual() -> FloatArray:
    """(g,) log weights of the grid when nothing else is known: half a normal distribution of the spread, and all else alike."""
    log = np.array([-0.5 * (one.spread / USUAL) ** 2 for one in grid()])
    return np.asarray(log - logsumexp(log))


def evidence(series: Series) -> tuple[Evidence, Series]:
    """The evidence of a series of up to LONGEST recordings, and the series without the recordings that were surely off: their error is unlimited.

    A recording was surely off where that is 99 times likelier than all else, a change or none, with what was measured after it.
    """
    for _ in range(series.value.size // 4 + 1):
        found, off = _evidence(series)
        if not off:
            break
        sigma = series.sigma.copy()
        sigma[list(off)] = np.maximum(sigma[list(off)], UNLIMITED)
        series = replace(series, sigma=sigma)
    return found, series


def _evidence(series: Series) -> tuple[Evidence, tuple[int, ...]]:
    """The evidence, and the numbers of recordings that were surely off."""
    n, changed, every = series.value.size, _first_change(series), grid()
    shapes = _shapes(series.time)
    begun = np.cumsum(shapes != 0.0, axis=0).T > 0
    chance = np.where(np.arange(changed) < n, ODD, ODD**2)[:, None]
    none, odd, change = (np.full((len(every), n), -np.inf) for _ in range(3))
    off = np.full((changed, n), -np.inf)
    for row, wander in enumerate(every):
        parts = _whitened(series, wander, shapes)
        none[row] = parts.none
        ratios = parts.ratios(begun)
        each = chance * ratios[:changed]
        odd[row] = np.log1p(each.sum(axis=0))
        change[row, 1:] = np.log(ratios[changed:, 1:].sum(axis=0) / len(DURATIONS))
        with np.errstate(divide="ignore"):  # of what has not begun
            off = np.logaddexp(off, usual()[row] + parts.none + np.log(each))
    prior = usual()[:, None] + none
    share = np.exp(off - logsumexp(np.logaddexp(prior + odd, prior + change + np.log(ODD)), axis=0))
    share[np.arange(n), np.arange(n)] = 0.0  # a recording is off only in the light of one after it
    share[np.arange(n, changed), np.arange(1, n)] = 0.0
    sure = [int(place) for place in np.flatnonzero(share.max(axis=1) > SURE)]
    return Evidence(none, odd, change), tuple(sorted({k for place in sure for k in ((place,) if place < n else (place - n, place - n + 1))}))


def statistic(found: Evidence, weights: FloatArray) -> FloatArray:
    """(n,) log of Shiryaev and Roberts' statistic after each recording."""
    none = weights[:, None] + found.none
    return np.asarray(logsumexp(none + found.change, axis=0) - logsumexp(none + found.odd, axis=0))


def learned(every: Iterable[Evidence], rounds: int = 5) -> FloatArray:
    """(g,) log weights of the grid from many series of alike machines: each has a say, whether or not it changed."""
    totals = [np.logaddexp(one.none + one.odd, one.none + one.change)[:, -1] for one in every if one.none.shape[1] > 2]
    weights = usual()
    for _ in range(rounds if totals else 0):
        shares = sum((np.exp(weights + total - logsumexp(weights + total)) for total in totals), FEW * np.exp(usual()))
        weights = np.log(shares / shares.sum())
    return np.asarray(weights)


def spread(series: Series, weights: FloatArray) -> tuple[float, FloatArray]:
    """Standard deviation of the wander of a series without a change, and (g,) how likely each wander of the grid is."""
    none = np.array([_whitened(series, wander, np.zeros((series.value.size, 0))).none[-1] for wander in grid()])
    share = np.exp(weights + none - logsumexp(weights + none))
    return float(np.sqrt(sum(part * wander.spread**2 for part, wander in zip(share, grid(), strict=True)))), share


def changes(series: Series, weights: FloatArray, threshold: float, known: Evidence | None = None) -> tuple[Change, ...]:
    """Every change of a series, in order; threshold: log of the statistic from which a change is declared; known: its evidence, if it is."""
    if known is not None and series.value.size <= LONGEST and not np.any(statistic(known, weights) >= threshold):
        return ()
    found: list[Change] = []
    start = 0
    while series.value.size - start > 2:
        part = series.after(start).until(LONGEST)
        seen, part = evidence(part)
        declared = _passed(seen, weights, threshold)
        if declared is not None:
            change = _located(part, weights)
            if _passed(evidence(_without(part, change))[0], weights, threshold) is not None:  # there is more than one
                change = _located(part.until(declared + 1), weights)
            found.append(_moved(change, start, start + declared))
            ended = int(np.searchsorted(part.time, part.time[change.after] + change.duration))
            start += max(ended, change.after + 1)  # what follows is compared with what came after the change
        elif series.value.size - start > LONGEST:
            start += LONGEST // 2
        else:
            break
    return tuple(found)


def _passed(found: Evidence, weights: FloatArray, threshold: float) -> int | None:
    """The recording with which a change is declared."""
    passed = np.flatnonzero(statistic(found, weights) >= threshold)
    return int(passed[0]) if passed.size else None


def _without(series: Series, change: Change) -> Series:
    shape = _shape(series.time, change.after, change.duration)
    return Series(series.time, series.value - change.size * shape, series.sigma)


def _moved(change: Change, by: int, declared: int) -> Change:
    """The same in numbers of a longer series."""
    return replace(change, after=change.after + by, first=change.first + by, last=change.last + by, declared=declared)


def _located(series: Series, weights: FloatArray) -> Change:
    """When the one change of a series was, and by how much."""
    n, first = series.value.size, _first_change(series)
    shapes = _shapes(series.time)
    log, mean, power = [], [], []
    for weight, wander in zip(weights, grid(), strict=True):
        parts = _whitened(series, wander, shapes)
        for size in SIZES:
            information, score = parts.information[first:, -1], parts.score[first:, -1]
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
        statistic=float(statistic(_evidence(series)[0], weights)[-1]),
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


def _whitened(series: Series, wander: Wander, shapes: FloatArray) -> _Whitened:
    """What each shape (n, k) explains after each recording, for one wander.

    The Cholesky factor of the first recordings is the corner of that of all, so that running sums give the answers after each.
    """
    distance = np.abs(series.time[:, None] - series.time[None, :])
    slow = wander.slow * np.exp(-distance / wander.length)
    factor = np.linalg.cholesky(wander.spread**2 * slow + np.diag(wander.spread**2 * (1.0 - wander.slow) + series.sigma**2 + EXACT**2))
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


def _first_change(series: Series) -> int:
    """Number of the first change among the shapes."""
    return 2 * series.value.size - 1


def _shapes(time: FloatArray) -> FloatArray:
    """(n, 2 n - 1 + (n - 1) durations): a recording that is off, two in a row, and each change, by duration and by the recording after which it
    begins."""
    changed = [_shape(time, after, duration) for duration in DURATIONS for after in range(time.size - 1)]
    single = np.eye(time.size)
    return np.column_stack((single, single[:, :-1] + single[:, 1:], *changed))


def _shape(time: FloatArray, after: int, duration: float) -> FloatArray:
    """(n,) from 0 to 1: a change that begins after a recording."""
    since = time - time[after]
    return np.clip(since / duration, 0.0, 1.0) if duration else np.asarray(since > 0.0, dtype=np.float64)
