"""Trends in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime

import numpy as np

from xy_sysid.fleets.estimate import lasting
from xy_sysid.fleets.history import BEGIN, DAY, FEWEST, MONTH, Axis
from xy_sysid.fleets.trends import Event, Moved, Trend, Trends
from xy_sysid.units import Units, readable

MOST = 6  # changes of an event that are listed individually
SIGMAS = 99  # above this the exact number carries no information


def sentence(event: Event, axis: Axis) -> str:
    """The change, its date, its size, its certainty and its cause."""
    first, *others = event.moved
    text = f"{event.machine} {event.axis}: {told(first, axis)}."
    if others:
        text += f" At the same time: {'; '.join(told(one, axis) for one in others[:MOST])}{_more(len(others) - MOST)}."
    if event.cause is None:
        return f"{text} No cause in the table explains it."
    return f"{text} Likely cause: {event.cause.cause}. {event.cause.check}".rstrip()


def _more(count: int) -> str:
    return f"; and {count} more" if count > 0 else ""


def told(one: Moved, axis: Axis) -> str:
    """One change in words."""
    if math.isnan(one.sigmas):
        often = f"in {100 * one.after:.0f} % of the recordings, before in {100 * one.before:.0f} %"
        return f"{one.column} is named {often}, since {day(one.since)}"
    gradually = f", over {one.duration:.0f} days" if one.duration >= 1.0 else ""
    sigmas = f"{f'{one.sigmas:.2g}' if one.sigmas <= SIGMAS else f'more than {SIGMAS}'} sigma"
    size = f"{100 * one.part:+.3g} %, {sigmas}" if math.isfinite(one.part) else sigmas
    return f"{one.column} {from_to(one.before, one.after, Units(*axis.units).of(one.unit))} since {day(one.since)}{gradually} ({size})"


def from_to(before: float, after: float, unit: str) -> str:
    """The change of a value in words. A negative value neither rises nor falls: its size may do the opposite."""
    scale, unit = readable(unit)
    verb = "changed" if min(before, after) < 0.0 else "rose" if after > before else "fell"
    return f"{verb} from {before * scale:.4g} to {after * scale:.4g} {unit}".rstrip()


def day(date: datetime) -> str:
    """3 March 2026, with the time of day if known; the time since the start if no clock gives the date."""
    if _has_no_clock(date):
        return f"{(date - BEGIN).total_seconds() / 60.0:.4g} min after the start"
    text = f"{date.day} {date:%B %Y}"
    return text if (date.hour, date.minute, date.second) == (0, 0, 0) else f"{text} {date:%H:%M}"


def _has_no_clock(date: datetime) -> bool:
    return date.year == BEGIN.year


def chance(one: Moved) -> str:
    """How rarely such evidence occurs by chance."""
    return f"once in {one.one_in:.1e} axis-months" if one.one_in < 1e9 else "less than once in 1e9 axis-months"


def summary(trends: Trends) -> str:
    """The amount of data analysed, in words."""
    dated = [axis for axis in trends.axes if len(axis.dates) >= FEWEST]
    out = sum(axis.left_out for axis in trends.axes)
    months = sum(axis.months for axis in dated)
    seen = f"{months:.3g} axis-months" if months >= 1.0 else lasting(DAY * MONTH * max((axis.months for axis in dated), default=0.0))
    axes = "1 axis" if len(dated) == 1 else f"{len(dated)} axes"
    text = f"{axes}, {len(frozenset[str]().union(*(axis.sources for axis in dated)))} recordings, {seen}"
    return text + (f"; {out} {'row' if out == 1 else 'rows'} without a date or an answer {'is' if out == 1 else 'are'} left out" if out else "")


def gaps(trends: Trends) -> list[str]:
    """What the table cannot show, one sentence for each reason; empty if nothing is missing."""
    axes = [(f"{one.machine} {one.axis}", one) for one in trends.axes]
    lost = [(f"{one.machine} with its newest" if one.newest else one.machine, one.recordings) for one in trends.unread]
    silent = [(name, one.silent) for name, one in axes if one.silent]
    short = [(name, len(one.dates)) for name, one in axes if len(one.dates) < FEWEST]
    other = [(name, one.other_units) for name, one in axes if one.other_units]
    equal = [(name, len(one.dates)) for name, one in axes if len(one.dates) >= FEWEST and one.dates[0] == one.dates[-1]]
    counted = (
        ("Recordings that could not be read", sum(count for _, count in lost), lost),
        ("Axes whose newest recordings have no answer", len(silent), silent),
        (f"Axes that are not compared, since fewer than {FEWEST} recordings have a date, an answer and the units of the newest", len(short), short),
        ("Axes on which no change can be found, since all recordings have the same date", len(equal), equal),
        ("Recordings left out, since the newest of their axis has other units", sum(count for _, count in other), other),
    )
    return [f"{what}: {total} ({_each(each)})." for what, total, each in counted if each]


def _each(named: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{name}: {count}" for name, count in named[:MOST]) + _more(len(named) - MOST)


def clocked(dates: Sequence[datetime]) -> tuple[list[datetime] | list[float], str]:
    """The dates to plot, and the axis label: min after the start if no clock gives the date."""
    if dates and _has_no_clock(dates[0]):
        return [(date - BEGIN).total_seconds() / 60.0 for date in dates], "min after the start"
    return list(dates), ""


def widest(trends: Trends) -> list[tuple[str, float, float]]:
    """For each parameter: median spread between recordings and median standard error of one recording, fractions of the value.

    The error is NaN for a parameter without an interval.
    """
    found: dict[str, list[Trend]] = {}
    for one in trends.trends:
        found.setdefault(one.history.column, []).append(one)
    rows = []
    for column, parts in found.items():
        spreads = sorted(one.spread for one in parts)
        own = sorted(float(sigma) for one in parts for sigma in one.history.series.sigma[np.isfinite(one.history.high - one.history.low)])
        rows.append((column, spreads[len(spreads) // 2], own[len(own) // 2] if own else math.nan))
    return sorted(rows, key=lambda row: -row[1])


def percent(part: float) -> str:
    """A fraction in per cent; a dash if there is none."""
    return "-" if math.isnan(part) else f"{100 * part:.2g} %"
