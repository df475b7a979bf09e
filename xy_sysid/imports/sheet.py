"""The content of a file before its meaning is known: columns with a name, perhaps a unit, and numbers or text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording
from xy_sysid.samples.block import FloatArray

WORD = re.compile(r"[^\W_]+")
CAMEL = re.compile(r"(?<=[a-zà-ÿ0-9])(?=[A-ZÀ-Þ][a-zà-ÿ])|(?<=[a-zà-ÿ])(?=[A-ZÀ-Þ])")
PART = re.compile(r"\[(\d{1,9})\]")
TWICE = "Give every column its own name, or choose columns by number with --map, 1 for the first."
MANY = 12  # names said in one line
EVEN = 0.01  # of the step; a column whose steps differ by less is a clock


@dataclass(frozen=True, slots=True)
class Column:
    """name: as the file has it; unit: as the file says, "" for nothing; values: (n,), not a number where there is none; words: text instead.

    clock:  (n,) s, the instants of these values where the column has a time of its own
    starts: rows at which a stretch begins that does not follow the one before
    full:   its name with those of its structs or groups, where ``name`` is without them
    """

    name: str
    unit: str
    values: FloatArray
    words: tuple[str, ...] = ()
    clock: FloatArray | None = None
    starts: tuple[int, ...] = ()
    full: str = ""

    @property
    def step(self) -> float:
        """By which the numbers rise evenly from row to row, as those of a clock do; 0 if they do not."""
        finite = self.values[np.isfinite(self.values)]
        steps = np.diff(finite)
        step = float(np.median(steps)) if steps.size > 1 else 0.0
        return step if step > 0.0 and float(np.max(np.abs(steps - step))) < EVEN * step else 0.0


@dataclass(frozen=True, slots=True)
class Sheet:
    """The columns of one file.

    fs: Hz, if the file says it; kind: what the file calls a column; notes: what was odd
    arrays: of the contract's names (u, y, t, ...), where the file has them
    bad: what stands in a cell that is no number, by column: said when the column is to be used
    """

    path: Path
    columns: tuple[Column, ...]
    kind: str = "column"
    fs: float | None = None
    notes: tuple[str, ...] = ()
    bad: dict[str, str] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] | None = None

    def names(self) -> str:
        """For people: the columns there are."""
        shown = [column.name for column in self.columns]
        return "it has " + (", ".join(shown[:MANY]) + (f" and {len(shown) - MANY} more" if len(shown) > MANY else "") or "nothing")

    def find(self, name: str) -> Column:
        """The column of that name, in this spelling or another (case, blanks, signs), or of that number (1 is the first)."""
        for same in (lambda one: one == name, lambda one: one.casefold() == name.casefold(), lambda one: spoken(one) == spoken(name) != ()):
            found = [column for column in self.columns if same(column.name) or (column.full and same(column.full))]
            if len(found) > 1:
                raise BadRecording(self.path, f"the {self.kind} {name!r} is there twice", TWICE)
            if found:
                return self.usable(found[0])
        part = self._part(name)
        if part is not None:
            return part
        number = name.removeprefix("#")
        if number.isascii() and number.isdigit() and 1 <= int(number[:9]) <= len(self.columns):
            return self._numeric(self.columns[int(number) - 1])
        raise BadRecording(self.path, f"no {self.kind} {name!r}; {self.names()}", "See xy-sysid columns FILE.")

    def _part(self, name: str) -> Column | None:
        """One stretch of a column of several: data[2].speed is the third (they count from 0) of data[*].speed."""
        which = PART.search(name)
        whole = next((column for column in self.columns if which and column.starts and column.name == PART.sub("[*]", name, count=1)), None)
        if which is None or whole is None or int(which[1]) >= len(whole.starts):
            return None
        ends = [*whole.starts[1:], len(whole.values)]
        rows = slice(whole.starts[int(which[1])], ends[int(which[1])])
        return replace(whole, name=name, values=whole.values[rows], words=whole.words[rows], starts=())

    def usable(self, column: Column) -> Column:
        """The column; raises BadRecording if it holds something that is not a number, or if another has its name."""
        if sum(other.name == column.name for other in self.columns) > 1:
            raise BadRecording(self.path, f"row 1: the {self.kind} {column.name!r} is there twice", TWICE)
        return self._numeric(column)

    def _numeric(self, column: Column) -> Column:
        if column.name in self.bad:
            raise BadRecording(self.path, self.bad[column.name], "Correct or delete that row, or choose another column.")
        return column


def spoken(name: str) -> tuple[str, ...]:
    """The words of a name, small: "Motor_Voltage", "motorVoltage" and "MOTOR VOLTAGE" are one."""
    return tuple(word.casefold() for part in CAMEL.split(name) for word in WORD.findall(part))
