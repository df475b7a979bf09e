"""A column of instants --> seconds: numbers in a unit or since 1970, dates, times of the day, and times with their unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.foreign_units import to_si, unit_of
from xy_sysid.imports.names import meaning
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.sheet import Column
from xy_sysid.samples.block import FloatArray

CLOCK = re.compile(
    r"(?P<day>.*?[^\d:])??(?:(?P<hours>\d+):)?(?P<minutes>\d+):(?P<seconds>[0-5]?\d(?:[.,]\d+)?)(?::(?P<millis>\d{1,3}))?\s*(?P<half>[AaPp][Mm])?"
)
WITH_UNIT = re.compile(r"(?P<number>[-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*(?P<unit>[A-Za-zµμ]+)")
FROM, UNTIL = 978307200.0, 4133980800.0  # s since 1970, of the years 2001 to 2100: a clock with such a time counts from 1970
EXACT = 1e17  # larger numbers are ns since 1970, which a double of seconds cannot represent
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)
DAY = 86400.0
ACT = "Give seconds, times like 12:00:00.001, or dates like 2026-03-01T12:00:00.001."


@dataclass(frozen=True, slots=True)
class Stamps:
    """Instants as written: values (n,) in a unit of ``scale`` s; far: they count from so long ago that doubles of seconds are too coarse."""

    values: FloatArray
    scale: float
    far: bool

    def after(self, other: Stamps) -> FloatArray:
        """(n,) s after the first instant of the other."""
        first = other.values[np.isfinite(other.values)][:1]
        return np.asarray((self.values - (first[0] if first.size else 0.0) * (other.scale / self.scale)) * self.scale)

    def seconds(self) -> FloatArray:
        """(n,) s, counted from the first if ``far``."""
        return self.after(self) if self.far else self.values * self.scale


def stamps(path: Path, column: Column, reading: Reading, notes: list[str]) -> Stamps:
    """The instants of a column, by the given unit, its own, that of its name, or its size. Raises BadRecording if it holds no times."""
    if column.words:
        values, unit = _of_words(path, column)
        return Stamps(values, unit_of(unit).scale, far=True)
    known = meaning(column.name, "")
    unit = reading.unit("time") or column.unit or (known.unit if known is not None else "")
    largest = float(np.max(np.abs(column.values[np.isfinite(column.values)]), initial=0.0))
    if not unit:
        unit = next((name for name in ("ns", "us", "ms") if FROM <= largest * unit_of(name).scale < UNTIL), "s")
        if unit != "s":
            notes.append(f"the time {column.name!r} reads {largest:.4g}: it is taken as {unit} since 1970")
    _, found = to_si(column.values, unit, "time", notes)
    if found.quantity != "time":
        raise BadRecording(path, f"the unit {unit!r} of the time is not a unit of time", "Give s, ms, us, ns, min or h with --unit time=...")
    return Stamps(column.values, found.scale * (reading.scale("time") or 1.0), far=largest > EXACT)


def _of_words(path: Path, column: Column) -> tuple[FloatArray, str]:
    """Numbers (n,) and their unit; raises BadRecording that names the first word that is no time."""
    for way, unit in WAYS:
        try:
            return way(column.words), unit
        except ValueError:
            continue
    number, text = next((k, text) for k, text in enumerate(column.words, 1) if not _told(text))
    raise BadRecording(path, f"the time {column.name!r} is {text[:40]!r} in sample {number}", ACT)


def _told(text: str) -> bool:
    """Whether a text is a time in one of the known forms."""
    for way, _ in WAYS:
        try:
            way([text])
        except ValueError:
            continue
        return True
    return False


def _dates(words: Sequence[str]) -> FloatArray:
    """Microseconds since 1970, which a double represents exactly."""
    found = [datetime.fromisoformat(text) for text in words]
    aware = [one if one.tzinfo else one.replace(tzinfo=UTC) for one in found]
    return np.array([(one - BEGIN) // timedelta(microseconds=1) for one in aware], np.float64)


def _clock(words: Sequence[str]) -> FloatArray:
    """Seconds since the first midnight, from hours, minutes and seconds. A new date, or a clock that goes back by half a day, starts the next day."""
    found = np.empty(len(words))
    days, before = 0, ""
    for k, text in enumerate(words):
        parts = CLOCK.fullmatch(text.strip())
        if parts is None:
            raise ValueError(text)
        hours = int(parts["hours"] or 0)
        if parts["half"]:
            hours = hours % 12 + 12 * (parts["half"].lower() == "pm")
        found[k] = days * DAY + hours * 3600.0 + int(parts["minutes"]) * 60.0 + float(parts["seconds"].replace(",", "."))
        found[k] += 1e-3 * float(parts["millis"] or 0)
        if k and ((parts["day"] or "") != before or found[k] < found[k - 1] - DAY / 2):
            days += 1
            found[k] += DAY
        before = parts["day"] or ""
    return found


def _with_units(words: Sequence[str]) -> FloatArray:
    """Seconds from texts like 0.002 sec or 2 ms."""
    found = []
    for text in words:
        parts = WITH_UNIT.fullmatch(text.strip())
        unit = unit_of(parts["unit"]) if parts is not None else None
        if parts is None or unit is None or unit.quantity != "time":
            raise ValueError(text)
        found.append(float(parts["number"].replace(",", ".")) * unit.scale)
    return np.array(found)


WAYS: tuple[tuple[Callable[[Sequence[str]], FloatArray], str], ...] = ((_dates, "us"), (_clock, "s"), (_with_units, "s"))
