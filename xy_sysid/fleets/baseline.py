"""Has a parameter of an axis left its interval since commissioning? Compares the estimates of a running machine with those of a model file.

The baseline is one recording, and the data since the node started are another: temperature, load and lubrication differ between the two and not
within them. Therefore the estimates of the running machine are not independent recordings. Each is compared with the baseline by the
test of ``change``: its statistic for two recordings whose wander is known. The wander is the spread between recordings, of the fleet's table or
the usual one. The threshold is that of a trend with one recording a day.

As in a trend, one or two outlying estimates are no change. A parameter has left its interval when AGREEING consecutive estimates show it, from
stretches without a common sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from functools import cache

import numpy as np
from scipy.special import logsumexp

from xy_sysid.fleets.causes import Cause, Causes
from xy_sysid.fleets.change import evidence
from xy_sysid.fleets.columns import column_of
from xy_sysid.fleets.history import BEGIN, MONTH, History
from xy_sysid.fleets.wander import SPREADS, USUAL, Series, grid
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

AGREEING = 3  # estimates in a row; a trend, too, declares a change with its third recording
A_MONTH = MONTH  # recordings: one a day


@dataclass(frozen=True, slots=True)
class Compared:
    """One parameter at commissioning and now.

    before, now: its value at commissioning and in the newest stretch; low, high: 95 % interval of an unchanged axis, with the spread between
        recordings; part: now over before, minus 1; NaN across zero
    statistic: least log statistic of the newest ``AGREEING`` estimates; -inf before there are that many
    left: True if it has left its interval; one_in: axis-months in which chance alone gives such evidence once
    """

    name: str
    unit: str
    before: float
    now: float
    low: float
    high: float
    part: float
    statistic: float
    left: bool
    one_in: float


@dataclass(frozen=True, slots=True)
class Stretch:
    """The results of a stretch of data.

    parameters: name -> estimate, and log of the test's statistic; effects: of its model; units: name -> unit, where it differs from commissioning
    """

    parameters: Mapping[str, tuple[Estimate, float]] = field(default_factory=dict)
    effects: frozenset[str] = frozenset()
    units: Mapping[str, str] = field(default_factory=dict)


class Baseline:
    """The estimates of an axis at commissioning, and those received since.

    known: estimates at commissioning; spreads: between recordings, by table column, fraction of the value; column: maps a parameter name to a column
    effects: names of effects that models may contain, if models of different stretches may differ
    """

    def __init__(
        self, known: Iterable[Estimate], spreads: Mapping[str, float], column: Callable[[str], str] = column_of, effects: Collection[str] = ()
    ) -> None:
        every = {item.name: item for item in known}
        self._library, self._spreads, self._column = effects, spreads, column
        self._known, self._effects = {name: item for name, item in every.items() if finite(item)}, self._effects_of(every)
        self._heard: list[Stretch] = []
        self._newest = (-math.inf, -math.inf)

    def hear(self, estimates: Iterable[Estimate], begin: float, end: float) -> None:
        """Add the estimates of a stretch of data. begin, end: of the stretch, in s or in samples.

        They replace other estimates of the same stretch. A stretch that overlaps the previous one is ignored.
        """
        again = (begin, end) == self._newest
        if begin < self._newest[1] and not again:
            return
        every = {item.name: item for item in estimates}
        shared = [item for item in every.values() if item.name in self._known and finite(item)]
        units = {item.name: item.unit for item in shared if item.unit != self._known[item.name].unit}
        found = {item.name: (item, self._statistic(item)) for item in shared if item.name not in units}
        self._heard = [*(self._heard[:-1] if again else self._heard[1 - AGREEING :]), Stretch(found, self._effects_of(every), units)]
        self._newest = (begin, end)

    def compared(self, axis_months: float) -> tuple[Compared, ...]:
        """Comparison of every parameter that the baseline and the newest stretch both have."""
        newest = self._newest_stretch.parameters
        level = math.log(axis_months * A_MONTH * max(len(newest), 1))
        return tuple(self._compared(item, level, axis_months) for item, _ in newest.values())

    @property
    def other_units(self) -> Mapping[str, tuple[str, str]]:
        """Parameters that cannot be compared because their units differ: name -> (unit at commissioning, unit in the newest stretch)."""
        return {name: (self._known[name].unit, unit) for name, unit in self._newest_stretch.units.items()}

    @property
    def other_effects(self) -> Mapping[str, int]:
        """Effects that only one of the two models (newest stretch, commissioning) has -> number of consecutive stretches.

        The number is negative for an effect that is missing in the newest model.
        """
        found = {}
        for effect in sorted(self._newest_stretch.effects ^ self._effects if self._heard else ()):
            there = effect in self._newest_stretch.effects
            same = [(effect in one.effects) == there for one in reversed(self._heard)]
            found[effect] = (1 if there else -1) * (same.index(False) if False in same else len(same))
        return found

    @property
    def _newest_stretch(self) -> Stretch:
        return self._heard[-1] if self._heard else Stretch()

    def _effects_of(self, names: Iterable[str]) -> frozenset[str]:
        return frozenset(name.partition(".")[0] for name in names) & frozenset(self._library)

    @property
    def stretches(self) -> int:
        """Number of received stretches, at most ``AGREEING``."""
        return len(self._heard)

    def cause(self, items: Iterable[Compared], known: Causes) -> Cause | None:
        """The likeliest cause of the parameters that left their interval; None if the table has none."""
        return known.likeliest([(self._column(item.name), "up" if abs(item.now) > abs(item.before) else "down") for item in items if item.left])

    def _history(self, *items: Estimate) -> History:
        value, low, high = (np.array([getattr(item, name) for item in items]) for name in ("value", "low", "high"))
        level = max(float(np.median(np.abs(value))), float(np.nan_to_num(high - low).max()), np.finfo(np.float64).tiny)
        dates = tuple(BEGIN + timedelta(days=k) for k in range(len(items)))
        return History(
            column=self._column(items[0].name), unit=items[0].unit, dates=dates, value=value, low=low, high=high,
            logarithmic=bool(np.all(value > 0.0)), level=level,
        )  # fmt: skip

    def _spread(self, name: str) -> float:
        return self._spreads.get(self._column(name), USUAL)

    def _statistic(self, item: Estimate) -> float:
        return compare(self._history(self._known[item.name], item).series, self._spread(item.name))

    def _compared(self, item: Estimate, level: float, axis_months: float) -> Compared:
        before = self._known[item.name]
        history = self._history(before, item)
        width = Z95 * math.sqrt(2.0 * self._spread(item.name) ** 2 + float(np.sum(history.series.sigma**2)))
        low, high = sorted(history.changed(before.value, side * width) for side in (-1.0, 1.0))
        every = [heard.parameters[item.name][1] if item.name in heard.parameters else -math.inf for heard in self._heard]
        least = min(every) if len(every) == AGREEING else -math.inf
        return Compared(
            name=item.name, unit=item.unit, before=before.value, now=item.value, low=low, high=high,
            part=item.value / before.value - 1.0 if item.value * before.value > 0.0 else math.nan,
            statistic=least, left=least >= level, one_in=axis_months * math.exp(min(least - level, 300.0)),
        )  # fmt: skip


def compare(series: Series, spread: float) -> float:
    """Log of the Shiryaev-Roberts statistic after the second of two recordings with known wander. spread: its standard deviation."""
    told = Series(series.time, series.value, np.hypot(series.sigma, spread))
    found = evidence(told)[0]
    return float(logsumexp(_still() + found.none[:, -1] + found.change[:, -1]) - logsumexp(_still() + found.none[:, -1]))


@cache
def _still() -> FloatArray:
    """(g,) log weights of a grid of wanders in which only the smallest is possible."""
    return np.array([0.0 if one.spread == SPREADS[0] and not one.slow else -np.inf for one in grid()])


def finite(item: Estimate) -> bool:
    """True if the value is finite and no end of the interval is infinite; NaN ends (no interval) are allowed."""
    return math.isfinite(item.value) and not any(math.isinf(end) for end in (item.low, item.high))
