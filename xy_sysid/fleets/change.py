"""Has a parameter changed, when, and by how much? Bayesian sequential detection of a change in a series of estimates.

Each estimate is level + wander + error. The error is the recording's own and is known from its interval. The wander is the effect of temperature,
load and lubrication between recordings: a Gaussian process with standard deviation tau. A part of it is slow: its correlation falls as
exp(-distance / length). None of this is known. Therefore all wanders of a grid are weighted by how well they explain the series and the series of
all other axes of the table. A change starts after a recording and takes no time or several recordings. Its size is Gaussian, with a standard
deviation from another grid. For each start the likelihood ratio to no change has a closed form: the model is linear and Gaussian,
and level and size are integrated out.

The sum of the ratios over all starts is the Shiryaev-Roberts statistic. Without a change its mean is n after n recordings, on average over
the grid. Therefore a threshold c is passed at most once in c recordings. The allowed rate of false alarms gives c. One outlying recording,
or two in a row (another load, a loose cable), are not a change: with most rates a change needs a third recording to be declared.

Sources: Roberts, A comparison of some control chart procedures, Technometrics 8 (1966); Pollak & Siegmund, Approximations to the expected
sample size of certain sequential tests, Ann. Statist. 3 (1975); Shin, Ramdas & Rinaldo, E-detectors, New England J. Statist. Data Sci. 2 (2023).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from xy_sysid.fleets.wander import SIZES, Series, Whitened, grid, usual, whitened
from xy_sysid.samples.block import FloatArray

DURATIONS = (0.0, 5.0, 20.0, 80.0)  # of a change, usual distances between recordings
ODD = 0.01  # probability of an outlying recording; the probability that the next one is an outlier, too, is this once more
SURE = 0.99  # probability from which a recording counts permanently as an outlier
UNLIMITED = 1.0  # standard error of an outlier, as a fraction of the level
LONGEST = 200  # recordings analysed together; of a longer series the older half is dropped


@dataclass(frozen=True, slots=True)
class Evidence:
    """The evidence of a series, for each wander of the grid (g of them) after each recording (n).

    none: (g, n) log likelihood without a change; odd: (g, n) log factor by which single outlying recordings raise it
    change: (g, n) log of the sum of the likelihood ratios of all changes
    """

    none: FloatArray
    odd: FloatArray
    change: FloatArray


@dataclass(frozen=True, slots=True)
class Change:
    """A change of a series.

    after:    number of the last recording before it; first, last: 95 % interval of that number
    duration, size, sigma: usual distances between recordings that it took, fraction of the level, and its standard deviation; for a change that
        still continues, up to the last recording that it explains alone
    declared: number of the recording with which it was certain enough; statistic: log Shiryaev-Roberts statistic then and with all recordings
    """

    after: int
    first: int
    last: int
    duration: float
    size: float
    sigma: float
    declared: int
    statistic: float


def evidence(series: Series) -> tuple[Evidence, Series]:
    """The evidence of a series of up to LONGEST recordings, and the series in which certain outliers have an unlimited error.

    A recording is a certain outlier if that is 99 times more probable than everything else (a change or none), given the later recordings.
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
    """The evidence, and the indices of the certain outliers."""
    n, changed, every = series.value.size, _first_change(series), grid()
    shapes = hypotheses(series.time)
    none, odd, change = (np.full((len(every), n), -np.inf) for _ in range(3))
    off = np.full((changed, n), -np.inf)
    for row, wander in enumerate(every):
        parts = whitened(series, wander, shapes)
        none[row] = parts.none
        each, change[row] = weighed(parts, shapes)
        odd[row] = np.log1p(each.sum(axis=0))
        with np.errstate(divide="ignore"):  # of outliers after this recording
            off = np.logaddexp(off, usual()[row] + parts.none + np.log(each))
    prior = usual()[:, None] + none
    share = np.exp(off - logsumexp(np.logaddexp(prior + odd, prior + change + np.log(ODD)), axis=0))
    share[np.arange(n), np.arange(n)] = 0.0  # later recordings are needed to call one an outlier
    share[np.arange(n, changed), np.arange(1, n)] = 0.0
    sure = [int(place) for place in np.flatnonzero(share.max(axis=1) > SURE)]
    return Evidence(none, odd, change), tuple(sorted({k for place in sure for k in ((place,) if place < n else (place - n, place - n + 1))}))


def weighed(parts: Whitened, shapes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """For one wander: (2 n - 1, n) likelihood ratios of one or two outlying recordings, times their probability; and (n,) log of the sum of the
    ratios of all changes.

    shapes: from ``hypotheses``; parts: the whitened shapes
    """
    n = shapes.shape[0]
    ratios = parts.ratios(np.argmax(shapes != 0.0, axis=0))
    chance = np.where(np.arange(2 * n - 1) < n, ODD, ODD**2)[:, None]
    change = np.full(n, -np.inf)
    change[1:] = np.log(ratios[2 * n - 1 :, 1:].sum(axis=0) / len(DURATIONS))
    return chance * ratios[: 2 * n - 1], change


def statistic(found: Evidence, weights: FloatArray) -> FloatArray:
    """(n,) log of the Shiryaev-Roberts statistic after each recording."""
    none = weights[:, None] + found.none
    return np.asarray(logsumexp(none + found.change, axis=0) - logsumexp(none + found.odd, axis=0))


def spread(series: Series, weights: FloatArray) -> tuple[float, FloatArray]:
    """Standard deviation of the wander of a series without a change, and (g,) the probability of each wander of the grid."""
    none = np.array([whitened(series, wander, np.zeros((series.value.size, 0))).none[-1] for wander in grid()])
    share = np.exp(weights + none - logsumexp(weights + none))
    return float(np.sqrt(sum(part * wander.spread**2 for part, wander in zip(share, grid(), strict=True)))), share


def changes(series: Series, weights: FloatArray, threshold: float, known: Evidence | None = None) -> tuple[Change, ...]:
    """Every change of a series, in order; threshold: log statistic that declares a change; known: the series' evidence if already computed."""
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
            if _passed(evidence(_without(part, change))[0], weights, threshold) is not None:  # there is more than one change
                change = _alone(part, declared, weights, threshold)
            found.append(_moved(change, start, start + declared))
            ended = int(np.searchsorted(part.time, part.time[change.after] + change.duration))
            start += max(ended, change.after + 1)  # compare the following data with those after this change
        elif series.value.size - start > LONGEST:
            start += LONGEST // 2
        else:
            break
    return tuple(found)


def _alone(series: Series, declared: int, weights: FloatArray, threshold: float) -> Change:
    """The first of several changes of a series, from the recordings that it explains alone."""
    change, more = _located(series.until(declared + 1), weights), 1
    while declared + 1 + more < series.value.size:
        part = series.until(declared + 1 + more)
        longer = _located(part, weights)
        if _passed(evidence(_without(part, longer))[0], weights, threshold) is not None:
            break
        change, more = longer, 2 * more
    return change


def _passed(found: Evidence, weights: FloatArray, threshold: float) -> int | None:
    """Index of the recording at which a change is declared; None without one."""
    passed = np.flatnonzero(statistic(found, weights) >= threshold)
    return int(passed[0]) if passed.size else None


def _without(series: Series, change: Change) -> Series:
    shape = _shape(series.time, change.after, change.duration)
    return Series(series.time, series.value - change.size * shape / shape[-1], series.sigma)


def _moved(change: Change, by: int, declared: int) -> Change:
    """The change with indices in a longer series."""
    return replace(change, after=change.after + by, first=change.first + by, last=change.last + by, declared=declared)


def _located(series: Series, weights: FloatArray) -> Change:
    """Date and size of the single change of a series; if it still continues, the size is the present one and the final size is unknown."""
    n, first = series.value.size, _first_change(series)
    shapes = hypotheses(series.time)
    now = shapes[-1, first:]
    log, mean, power = [], [], []
    for weight, wander in zip(weights, grid(), strict=True):
        parts = whitened(series, wander, shapes[:, first:])
        information, score = parts.sizes()
        for size in SIZES:
            shrunk = size**2 / (1.0 + size**2 * information)
            log.append(weight + parts.none[-1] - 0.5 * np.log1p(size**2 * information) + 0.5 * shrunk * score**2)
            mean.append(now * shrunk * score)
            power.append(now**2 * shrunk)
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
        duration=min(DURATIONS[int(np.argmax(each[:, after]))], float(series.time[-1] - series.time[after])),
        size=size,
        sigma=float(np.sqrt(max(variance, 0.0))),
        declared=n - 1,
        statistic=float(statistic(_evidence(series)[0], weights)[-1]),
    )


def _first_change(series: Series) -> int:
    """Index of the first change among the shapes."""
    return 2 * series.value.size - 1


def hypotheses(time: FloatArray) -> FloatArray:
    """(n, 2 n - 1 + (n - 1) durations) shapes: one outlying recording, two in a row, and each change, by duration and by the recording after which
    it starts."""
    changed = [_shape(time, after, duration) for duration in DURATIONS for after in range(time.size - 1)]
    single = np.eye(time.size)
    return np.column_stack((single, single[:, :-1] + single[:, 1:], *changed))


def _shape(time: FloatArray, after: int, duration: float) -> FloatArray:
    """(n,) from 0 to 1: a change that starts after a recording."""
    since = time - time[after]
    return np.clip(since / duration, 0.0, 1.0) if duration else np.asarray(since > 0.0, dtype=np.float64)
