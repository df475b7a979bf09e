"""From the table to the series of each parameter of each axis, in which changes are looked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.fleets.wander import Series
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

DAY = 86400.0  # s
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)  # used if no clock gives the date, for a recording that is analysed in parts
MONTH = 30.4375  # days
FEWEST = 4  # recordings with a value; a shorter series is not analysed
ONE_STEP = ("held_out_error", "noise")  # for a one-step prediction these have another meaning and are not compared


@dataclass(frozen=True, slots=True)
class History:
    """One parameter of one axis.

    column, unit: of the table; dates: (n,); value, low, high: (n,) in this unit, NaN without an interval
    logarithmic: changes are looked for in the logarithm; level: otherwise values are divided by it
    """

    column: str
    unit: str
    dates: tuple[datetime, ...]
    value: FloatArray
    low: FloatArray
    high: FloatArray
    logarithmic: bool
    level: float

    @property
    def series(self) -> Series:
        """The series as fractions of the level, over the usual distance between recordings."""
        value, width = self.value, self.high - self.low
        if self.logarithmic:
            known = np.where(self.low > 0.0, self.low, np.nan)
            inside = np.log(self.high) - np.log(known)
            sigma = np.where(np.isfinite(inside), inside, width / value) / (2.0 * Z95)
        else:
            sigma = width / self.level / (2.0 * Z95)
        return Series(steps(self.dates), np.log(value) if self.logarithmic else value / self.level, np.nan_to_num(sigma))

    def plain(self, part: Any) -> Any:
        """Convert fractions of the level to the unit; an overflow gives infinity, for example as an end of an uninformative interval."""
        with np.errstate(over="ignore"):
            return np.exp(part) if self.logarithmic else part * self.level

    def changed(self, value: float, part: float) -> float:
        """The value after a change by this fraction of the level."""
        return value * float(np.exp(part)) if self.logarithmic else value + part * self.level


@dataclass(frozen=True, slots=True)
class Axis:
    """The table's content for one axis over time.

    units: of input and output in its last recording with an answer; dates: (n,) of its recordings in these units
    histories: of every parameter with enough values; named: effect -> (n,) whether it was named
    left_out: number of recordings without a date or an answer; other_units: number with an answer in other units, also left out
    silent: number of its newest recordings without an answer; sources: of the recordings in these units, once each
    """

    machine: str
    axis: str
    units: tuple[str, str]
    dates: tuple[datetime, ...]
    histories: tuple[History, ...]
    named: Mapping[str, NDArray[np.bool_]]
    left_out: int
    other_units: int = 0
    silent: int = 0
    sources: frozenset[str] = frozenset()

    @property
    def months(self) -> float:
        """Months from the first recording to the last."""
        return (self.dates[-1] - self.dates[0]).total_seconds() / DAY / MONTH if self.dates else 0.0

    @property
    def tests(self) -> int:
        """Number of series in which a change is looked for."""
        return len(self.histories) + len(self.named)


@dataclass(frozen=True, slots=True)
class Unread:
    """Recordings of a machine that could not be read. newest: True if no readable recording is as new as the last of them."""

    machine: str
    recordings: int
    newest: bool


def unread(rows: Sequence[Mapping[str, Any]]) -> tuple[Unread, ...]:
    """Every machine with unreadable recordings; their rows name no axis."""
    found = []
    for machine in sorted({row["machine"] for row in rows if not row["axis"]}):
        own = [row for row in rows if row["machine"] == machine]
        last = max((row["date"] for row in own if row.get("date") is not None), default=None)
        newest = last is not None and not any(row["axis"] and row.get("date") == last for row in own)
        found.append(Unread(machine, sum(not row["axis"] for row in own), newest))
    return tuple(found)


def axes(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> tuple[Axis, ...]:
    """Every axis of every machine in the rows of a table; units: of the columns that are followed."""
    parts: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        parts.setdefault((row["machine"], row["axis"]), []).append(row)
    return tuple(_axis(machine, axis, own, units) for (machine, axis), own in sorted(parts.items()) if axis)


def _axis(machine: str, axis: str, rows: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> Axis:
    every = sorted((row for row in rows if row.get("date") is not None), key=lambda row: row["date"])
    dated = [row for row in every if row.get("verdict") not in (None, "not_enough_data")]
    own = _units(dated[-1] if dated else {})
    alike = [row for row in dated if _units(row) == own]
    histories = (_history(column, unit, alike) for column, unit in units.items())
    effects = sorted({name for row in alike for name in _names(row)})
    return Axis(
        machine=machine,
        axis=axis,
        units=own,
        dates=tuple(row["date"] for row in alike),
        histories=tuple(one for one in histories if one is not None),
        named={name: np.array([name in _names(row) for row in alike]) for name in effects} if len(alike) >= FEWEST else {},
        left_out=len(rows) - len(dated),
        other_units=len(dated) - len(alike),
        silent=sum(not dated or row["date"] > dated[-1]["date"] for row in every),
        sources=frozenset(row["source"] for row in alike),
    )


def _units(row: Mapping[str, Any]) -> tuple[str, str]:
    return row.get("input_unit") or "V", row.get("output_unit") or "m"


def _names(row: Mapping[str, Any]) -> list[str]:
    return [name for name in (row.get("effects") or "").split(", ") if name]


def _history(column: str, unit: str, rows: Sequence[Mapping[str, Any]]) -> History | None:
    kept = [row for row in rows if _told(row, column)]
    if len(kept) < FEWEST:
        return None
    value, low, high = (np.array([_number(row, name) for row in kept]) for name in (column, f"{column}_low", f"{column}_high"))
    level = max(float(np.median(np.abs(value))), float(np.nanmedian(high - low)) if np.isfinite(high - low).any() else 0.0)
    if not level > 0.0:
        return None
    dates = tuple(row["date"] for row in kept)
    logarithmic = bool(np.all(value > 0.0))
    return History(column=column, unit=unit, dates=dates, value=value, low=low, high=high, logarithmic=logarithmic, level=level)


def _told(row: Mapping[str, Any], column: str) -> bool:
    """True if there is a finite value, without an interval or with finite ends, and it is not one of ONE_STEP in a row of that kind."""
    value, low, high = row.get(column), row.get(f"{column}_low"), row.get(f"{column}_high")
    ends = [end for end in (low, high) if end is not None]
    return value is not None and np.isfinite(value) and bool(np.all(np.isfinite(ends))) and not (row.get("one_step") and column in ONE_STEP)


def _number(row: Mapping[str, Any], name: str) -> float:
    value = row.get(name)
    return np.nan if value is None else float(value)


def steps(dates: Sequence[datetime]) -> FloatArray:
    """(n,) times in usual distances between recordings."""
    return np.array([(date - dates[0]).total_seconds() for date in dates]) / usual_distance(dates)


def usual_distance(dates: Sequence[datetime]) -> float:
    """The median distance between recordings of different dates, s."""
    between = np.diff([date.timestamp() for date in dates])
    return float(np.median(between[between > 0.0])) if np.any(between > 0.0) else 1.0
