"""The fleet's table -> changes, with date, size, certainty and likely cause."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fleets import presence
from xy_sysid.fleets.alike import learned_for_each
from xy_sysid.fleets.causes import Cause, Causes, Direction, causes
from xy_sysid.fleets.change import LONGEST, Change, Evidence, changes, evidence, spread
from xy_sysid.fleets.columns import column_of, columns
from xy_sysid.fleets.history import DAY, FEWEST, Axis, History, Unread, axes, unread, usual_distance
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import read
from xy_sysid.fleets.wander import Series
from xy_sysid.jit import on_all_cores
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

NAMED = 20  # maximum names in an error message
AXIS_MONTHS = 1000.0  # one false alarm is allowed per this many months of an unchanged axis


@dataclass(frozen=True, slots=True)
class Moved:
    """A change of one parameter of one axis.

    column, unit: of the table; before, after: its value; ``low`` to ``high``: 95 % interval of the value after; for an effect that is
        named or no longer named, the fraction of recordings that name it
    part:  after over before, minus 1; sigmas: size over its standard error; both NaN for an effect, part also across zero
    since: date of the first recording with it; earliest, latest: 95 % interval of that; declared: date from which it was certain enough
    one_in: axis-months in which chance alone gives such evidence once
    duration: days that the change took, until the last recording at most
    """

    column: str
    unit: str
    direction: Direction
    before: float
    after: float
    low: float
    high: float
    part: float
    sigmas: float
    since: datetime
    earliest: datetime
    latest: datetime
    declared: datetime
    one_in: float
    duration: float


@dataclass(frozen=True, slots=True)
class Event:
    """The changes of one axis at one time. moved: most certain first; cause: None if the table of causes has none."""

    machine: str
    axis: str
    moved: tuple[Moved, ...]
    cause: Cause | None

    @property
    def since(self) -> datetime:
        """Date of the most certain change."""
        return self.moved[0].since


@dataclass(frozen=True, slots=True)
class Trend:
    """One parameter of one axis over time.

    spread: standard deviation between recordings of an unchanged axis, fraction of the value; low, high: (n,) 95 % intervals including it
    next:   95 % interval of the next recording's value, if nothing changes
    moved:  its changes
    """

    machine: str
    axis: str
    history: History
    spread: float
    low: FloatArray
    high: FloatArray
    next: tuple[float, float]
    moved: tuple[Moved, ...]


@dataclass(frozen=True, slots=True)
class Trends:
    """All trends of a table. axes: with their dates; trends: of each parameter; events: changes, latest last; pooled: True if the spread was learned
    from several axes; unread: recordings that could not be read"""

    axes: tuple[Axis, ...]
    trends: tuple[Trend, ...]
    events: tuple[Event, ...]
    pooled: bool
    unread: tuple[Unread, ...] = ()

    def of(self, machine: str, axis: str, column: str) -> Trend:
        """One trend; raises BadInput if there is none."""
        for one in self.trends:
            if (one.machine, one.axis, one.history.column) == (machine, axis, column):
                return one
        known = _listed([f"{one.machine} {one.axis} {one.history.column}" for one in self.trends])
        raise BadInput("trend", f"{machine} {axis} {column}", f"one of {known}", "Choose one of these.")

    def of_machines(self, wanted: Collection[str]) -> Trends:
        """The trends of only these machines, with the spread that was learned from all."""
        return replace(
            self,
            axes=tuple(one for one in self.axes if one.machine in wanted),
            trends=tuple(one for one in self.trends if one.machine in wanted),
            events=tuple(one for one in self.events if one.machine in wanted),
            unread=tuple(one for one in self.unread if one.machine in wanted),
        )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")


def trend(
    table: Path | str,
    *,
    machines: Iterable[str] = (),
    own_causes: Path | None = None,
    axis_months: float = AXIS_MONTHS,
    tell: Callable[[float], None] = lambda _: None,
) -> Trends:
    """The changes in the recordings of a fleet's table.

    table:  the folder that ``fleet`` made; machines: only their trends; own_causes: a YAML file that adds to the table of causes
    axis_months: months of an unchanged axis in which one false alarm is allowed; tell: called with the progress, 0..1
    The spread between recordings is learned for each parameter from all axes of the table together, and is in every interval.
    Raises BadRecording if it is not a table, BadInput for a machine that is not in it, or if no axis has four recordings with a date and an
    answer.
    """
    known, found = causes(own_causes), read(Path(table))
    return of_rows(found.to_pylist(), found.column_names, known, axis_months, tell, machines)


def of_rows(
    rows: Sequence[Row],
    names: Iterable[str] = (),
    known: Causes | None = None,
    axis_months: float = AXIS_MONTHS,
    tell: Callable[[float], None] = lambda _: None,
    machines: Iterable[str] = (),
) -> Trends:
    """The changes in rows that are in no table; otherwise as ``trend``.

    names: of columns, if there are parameters of the user's own effects; known: causes, if not those of the package
    """
    if not axis_months > 0.0:
        raise BadInput("axis_months", axis_months, "above 0", "Usual is 1000.")
    present = sorted({row["machine"] for row in rows})
    wanted = set(machines) or set(present)
    if not wanted <= set(present):
        raise BadInput("machine", ", ".join(sorted(wanted - set(present))), f"one of {_listed(present)}", "Choose one of these.")
    ours = {item.name: item for item in columns()}
    followed = {name: item.unit for name, item in ours.items() if item.trended}
    followed |= {name: "" for end in names if (name := end.removesuffix("_low")) != end and name not in ours}
    every = axes(rows, followed)
    if not any(one.histories for one in every if one.machine in wanted):
        allowed = f"an axis with {FEWEST} of them that have a date and an answer"
        given = f"{len(rows)} row{'s' if len(rows) != 1 else ''}, {sum(one.recordings for one in unread(rows))} of which could not be read"
        raise BadInput("content of the table", given, allowed, "Record more often, or name their dates (xy-sysid fleet --names).")
    return replace(of_axes(every, known or causes(), axis_months, tell), unread=unread(rows)).of_machines(wanted)


def of_axes(every: Sequence[Axis], known: Causes, axis_months: float = AXIS_MONTHS, tell: Callable[[float], None] = lambda _: None) -> Trends:
    """The changes of axes whose histories are known; otherwise as ``trend``."""
    every_evidence: dict[tuple[int, str], tuple[Evidence, Series]] = {}
    count = sum(len(one.histories) for one in every)
    for number, one in enumerate(every):
        told = on_all_cores(lambda history: evidence(_newest(history)), one.histories)
        every_evidence |= {(number, history.column): item for history, item in zip(one.histories, told, strict=True)}
        tell(len(every_evidence) / count)
    weights: dict[tuple[int, str], FloatArray] = {}
    for name in dict.fromkeys(column for _, column in every_evidence):
        alike = {key: item for key, (item, _) in every_evidence.items() if key[1] == name}
        weights |= zip(alike, learned_for_each(list(alike.values())), strict=True)
    effects = {effect for one in every for effect in one.named}
    seen = [one.named.get(effect, np.zeros(len(one.dates), dtype=np.bool_)) for one in every for effect in effects]
    often = presence.learned(seen)
    trends: list[Trend] = []
    events: list[Event] = []
    for number, one in enumerate(every):

        def of(history: History, number: int = number, axis: Axis = one) -> Trend:
            key = number, history.column
            return _trend(axis, history, weights[key], every_evidence[key], axis_months)

        own = on_all_cores(of, one.histories)
        trends += own
        events += _events(one, [*(moved for item in own for moved in item.moved), *_named(one, often, axis_months)], known)
    pooled = sum(bool(one.histories) for one in every) > 1
    return Trends(axes=tuple(every), trends=tuple(trends), events=tuple(sorted(events, key=lambda item: item.since)), pooled=pooled)


def _newest(history: History) -> Series:
    return history.series.after(max(history.value.size - LONGEST, 0))


def threshold(axis: Axis, axis_months: float) -> float:
    """Log statistic from which a change is declared: each test exceeds it by chance at most once in the allowed number of recordings."""
    a_month = max(len(axis.dates) - 1, 1) / max(axis.months, 1e-9)
    return math.log(axis_months * a_month * max(axis.tests, 1))


def _trend(axis: Axis, history: History, weights: FloatArray, known: tuple[Evidence, Series], axis_months: float) -> Trend:
    series, level = history.series, threshold(axis, axis_months)
    found = changes(series, weights, level, known[0] if series.value.size == known[1].value.size else None)
    quiet = known[1]
    if found:
        last = found[-1]
        ended = int(np.searchsorted(series.time, series.time[last.after] + last.duration))
        start = min(max(ended, last.after + 1), series.value.size - 2)
        _, quiet = evidence(series.after(max(start, series.value.size - LONGEST)))
    between, _ = spread(quiet, weights)
    width = Z95 * np.sqrt(series.sigma**2 + between**2)
    weight = 1.0 / (quiet.sigma**2 + between**2)
    mean = float(np.sum(weight * quiet.value) / np.sum(weight))
    ahead = Z95 * math.sqrt(between**2 + float(np.median(quiet.sigma)) ** 2 + 1.0 / float(np.sum(weight)))
    moved = tuple(_moved(history, item, level, axis_months, mean_before(series, found, k)) for k, item in enumerate(found))
    return Trend(
        machine=axis.machine,
        axis=axis.axis,
        history=history,
        spread=between,
        low=history.plain(series.value - width),
        high=history.plain(series.value + width),
        next=(float(history.plain(mean - ahead)), float(history.plain(mean + ahead))),
        moved=moved,
    )


def mean_before(series: Series, found: Sequence[Change], number: int) -> float:
    """Level before a change: the mean of the values since the previous change."""
    first = 0
    if number:
        earlier = found[number - 1]
        first = min(int(np.searchsorted(series.time, series.time[earlier.after] + earlier.duration)), found[number].after)
    return float(np.mean(series.value[first : found[number].after + 1]))


def _moved(history: History, item: Change, level: float, axis_months: float, mean: float) -> Moved:
    before = float(history.plain(mean))
    ends = sorted(history.changed(before, item.size + side * Z95 * item.sigma) for side in (-1.0, 1.0))
    after, dates = history.changed(before, item.size), history.dates
    return Moved(
        column=history.column,
        unit=history.unit,
        direction="up" if abs(after) > abs(before) else "down",
        before=before,
        after=after,
        low=ends[0],
        high=ends[1],
        part=after / before - 1.0 if after * before > 0.0 else math.nan,
        sigmas=abs(item.size) / max(item.sigma, 1e-12),
        since=dates[item.after + 1],
        earliest=dates[item.first + 1],
        latest=dates[item.last + 1],
        declared=dates[item.declared],
        one_in=axis_months * math.exp(min(item.statistic - level, 300.0)),
        duration=item.duration * usual_distance(dates) / DAY,
    )


def _named(axis: Axis, often: FloatArray, axis_months: float) -> list[Moved]:
    """Effects that are named more or less often than before."""
    level, found = threshold(axis, axis_months), []
    for effect, named in axis.named.items():
        log = presence.statistic(named, often)
        passed = np.flatnonzero(log >= level)
        if not passed.size:
            continue
        place, first, last = presence.after(named, often)
        before, after = float(np.mean(named[: place + 1])), float(np.mean(named[place + 1 :]))
        found.append(
            Moved(
                column=column_of(effect),
                unit="of recordings",
                direction="up" if after > before else "down",
                before=before,
                after=after,
                low=math.nan,
                high=math.nan,
                part=math.nan,
                sigmas=math.nan,
                since=axis.dates[place + 1],
                earliest=axis.dates[first + 1],
                latest=axis.dates[last + 1],
                declared=axis.dates[int(passed[0])],
                one_in=axis_months * math.exp(min(float(log[-1]) - level, 300.0)),
                duration=0.0,
            )
        )
    return found


def _events(axis: Axis, moved: Sequence[Moved], known: Causes) -> list[Event]:
    """Group changes whose dates may be equal into one event."""
    groups: list[list[Moved]] = []
    for one in sorted(moved, key=lambda item: (item.earliest, item.latest)):
        if groups and one.earliest <= max(item.latest for item in groups[-1]):
            groups[-1].append(one)
        else:
            groups.append([one])
    return [
        Event(
            machine=axis.machine,
            axis=axis.axis,
            moved=tuple(sorted(group, key=lambda item: (-item.one_in, item.column))),
            cause=known.likeliest([(item.column, item.direction) for item in group]),
        )
        for group in groups
    ]
