"""Instants that are written in words: dates, times of the day, and times with their unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.foreign_units import unit_of
from xy_sysid.imports.sheet import Column
from xy_sysid.samples.block import FloatArray

CLOCK = re.compile(r"(?P<day>.*?\D)??(?:(?P<hours>\d+):)?(?P<minutes>\d+):(?P<seconds>\d+(?:[.,]\d+)?)\s*(?P<half>[AaPp][Mm])?")
WITH_UNIT = re.compile(r"(?P<number>[-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*(?P<unit>[A-Za-zµμ]+)")
DAY = 86400.0
ACT = "Give seconds, times like 12:00:00.001, or dates like 2026-03-01T12:00:00.001."


def seconds(path: Path, column: Column) -> FloatArray:
    """(n,) s from the first on; raises BadRecording that says which is none."""
    for way in (_dates, _clock, _with_units):
        try:
            return way(column.words)
        except ValueError:
            continue
    number, text = next((k, text) for k, text in enumerate(column.words, 1) if not _told(text))
    raise BadRecording(path, f"the time {column.name!r} is {text[:40]!r} in sample {number}", ACT)


def _told(text: str) -> bool:
    """By the first of the ways that it can be."""
    for way in (_dates, _clock, _with_units):
        try:
            way([text])
        except ValueError:
            continue
        return True
    return False


def _dates(words: Sequence[str]) -> FloatArray:
    found = [datetime.fromisoformat(text) for text in words]
    aware = [one if one.tzinfo else one.replace(tzinfo=UTC) for one in found]
    return np.array([(one - aware[0]).total_seconds() for one in aware])


def _clock(words: Sequence[str]) -> FloatArray:
    """Hours, minutes and seconds after any date: another date, or a clock that goes back by half a day and more, is the next day."""
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
        if k and ((parts["day"] or "") != before or found[k] < found[k - 1] - DAY / 2):
            days += 1
            found[k] += DAY
        before = parts["day"] or ""
    return np.asarray(found - found[0])


def _with_units(words: Sequence[str]) -> FloatArray:
    """0.002 sec, 2 ms."""
    found = []
    for text in words:
        parts = WITH_UNIT.fullmatch(text.strip())
        unit = unit_of(parts["unit"]) if parts is not None else None
        if parts is None or unit is None or unit.quantity != "time":
            raise ValueError(text)
        found.append(float(parts["number"].replace(",", ".")) * unit.scale)
    return np.asarray(np.array(found) - found[0])
