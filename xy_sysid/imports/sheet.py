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
MANY = 12  # most names in one line
EVEN = 0.01  # of the step; a column whose steps differ by less is a clock


@dataclass(frozen=True, slots=True)
class Column:
    """name: in the file; unit: in the file, "" for none; values: (n,), NaN where there is none; words: text instead of numbers.

    clock:  (n,) s, the instants of these values if the column has its own time
    starts: first rows of stretches that do not continue the one before
    full:   the name with those of its structs or groups, if ``name`` is without them
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
        """The even step by which the numbers rise from row to row, as of a clock; 0 if they do not."""
        finite = self.values[np.isfinite(self.values)]
        steps = np.diff(finite)
        step = float(np.median(steps)) if steps.size > 1 else 0.0
        return step if step > 0.0 and float(np.max(np.abs(steps - step))) < EVEN * step else 0.0


@dataclass(frozen=True, slots=True)
class Sheet:
    """The columns of one file.

    fs: Hz, if the file has it; kind: word for a column of such a file; notes: irregularities
    arrays: with the contract's names (u, y, t, ...), if the file has them
    bad: the first cell that is not a number, by column: reported when the column is used
    """

    path: Path
    columns: tuple[Column, ...]
    kind: str = "column"
    fs: float | None = None
    notes: tuple[str, ...] = ()
    bad: dict[str, str] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] | None = None

    def names(self) -> str:
        """A text with the names of the columns."""
        shown = [column.name for column in self.columns]
        return "it has " + (", ".join(shown[:MANY]) + (f" and {len(shown) - MANY} more" if len(shown) > MANY else "") or "nothing")

    def find(self, name: str) -> Column:
        """The column of this name, in any spelling (case, blanks, signs), or of this number (1 is the first). Raises BadRecording."""
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
        """One stretch of a column of several: data[2].speed is the third of data[*].speed."""
        which = PART.search(name)
        whole = next((column for column in self.columns if which and column.starts and column.name == PART.sub("[*]", name, count=1)), None)
        if which is None or whole is None or int(which[1]) >= len(whole.starts):
            return None
        ends = [*whole.starts[1:], len(whole.values)]
        rows = slice(whole.starts[int(which[1])], ends[int(which[1])])
        return replace(whole, name=name, values=whole.values[rows], words=whole.words[rows], starts=())

    def usable(self, column: Column) -> Column:
        """The column; raises BadRecording if a cell is not a number, or if another column has its name."""
        if sum(other.name == column.name for other in self.columns) > 1:
            raise BadRecording(self.path, f"row 1: the {self.kind} {column.name!r} is there twice", TWICE)
        return self._numeric(column)

    def _numeric(self, column: Column) -> Column:
        if column.name in self.bad:
            raise BadRecording(self.path, self.bad[column.name], "Correct or delete that row, or choose another column.")
        return column


def spoken(name: str) -> tuple[str, ...]:
    """The words of a name, in lower case: those of "Motor_Voltage", "motorVoltage" and "MOTOR VOLTAGE" are equal."""
    return tuple(word.casefold() for part in CAMEL.split(name) for word in WORD.findall(part))
