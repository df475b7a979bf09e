"""Which effects are tried first in a recording: those found in the first recording of the same axis.

The first recording, by date, is searched without prior knowledge. Therefore the order of the search depends only on the recordings, not on the
order of the analysis or the number of processes. Recordings without a date in their path are all searched without prior knowledge.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from xy_sysid.errors import BadInput
from xy_sysid.fleets.naming import Name, name_of
from xy_sysid.fleets.of_file import Done, Task
from xy_sysid.fleets.row import FirstSets, Row

COLUMNS = ("machine", "axis", "date", "source", "key", "verdict", "effects")  # columns of a table that this file reads
Place = tuple[datetime, str]  # date and file name; recordings are sorted by these


@dataclass
class _Machine:
    """The recordings of one machine, or of one of its axes if paths name the axis.

    given: tasks in order; earlier: rows of the table that are not among these; found: effects to try first, None until known
    """

    given: list[tuple[Place, Task]]
    earlier: dict[Place, list[Row]]
    found: FirstSets | None = None

    def next(self) -> Task | None:
        """The recording that must be analysed to find the effects to try first; None if they are known, or no recording is left."""
        while self.found is None and self.earlier and (not self.given or min(self.earlier) < self.given[0][0]):
            self.hear(self.earlier.pop(min(self.earlier)))
        return self.given.pop(0)[1] if self.found is None and self.given else None

    def hear(self, rows: Iterable[Row]) -> None:
        """Read the result of an analysis; one without an answer gives no information."""
        answered = [row for row in rows if row.get("verdict") not in (None, "not_enough_data")]
        if answered:
            self.found = tuple(sorted((row["axis"], tuple(row["effects"].split(", "))) for row in answered if row["effects"]))


class References:
    """Tasks in a possible order: first ``next`` until it is empty, with ``hear`` for each of them; then ``rest``."""

    def __init__(self, tasks: Sequence[Task], table: Iterable[Row]) -> None:
        """table: rows with ``COLUMNS`` of recordings analysed earlier."""
        self._machines: dict[tuple[str, str], _Machine] = {}
        self._undated: list[Task] = []
        self._asked: dict[str, _Machine] = {}
        self._by_key: dict[str, list[Row]] = {}
        self._folders: dict[str, str] = {}
        for task in tasks:
            name = _name(task)
            if name is not None and not name.said:
                self._folders[str(Path(task.path).parent)] = name.machine
            if name is None or name.date is None:
                self._undated.append(task)
            else:
                machine = self._machines.setdefault((name.machine, name.axis), _Machine([], {}))
                machine.given.append(((name.date, Path(task.path).name), task))
        for machine in self._machines.values():
            machine.given.sort(key=lambda item: (item[0], item[1].path))
        self._remember(table)

    def _remember(self, table: Iterable[Row]) -> None:
        given = {key: {place for place, _ in machine.given} for key, machine in self._machines.items()}
        for row in table:
            self._by_key.setdefault(row["key"], []).append(row)
            # a recording in a folder may have named another machine
            machine = self._folders.get(str(Path(str(row["source"])).parent)) or str(row["machine"])
            for key in {(machine, ""), (machine, str(row["axis"]))} & given.keys() if row["date"] is not None else ():
                place = row["date"], Path(row["source"]).name
                if place not in given[key]:
                    self._machines[key].earlier.setdefault(place, []).append(row)

    def next(self) -> list[Task]:
        """One recording of each machine without known effects."""
        asked = [(machine, task) for machine in self._machines.values() if (task := machine.next()) is not None]
        self._asked = {task.path: machine for machine, task in asked}
        return [task for _, task in asked]

    def hear(self, done: Done) -> None:
        """Read the result of a task of ``next``."""
        self._asked[done.path].hear(self._by_key.get(done.key, []) if done.unchanged else done.rows)

    def rest(self) -> list[Task]:
        """All other recordings, with the effects to try first."""
        known = [dataclasses.replace(task, first=machine.found or ()) for machine in self._machines.values() for _, task in machine.given]
        return [*known, *self._undated]


def _name(task: Task) -> Name | None:
    """The name; None if the path does not match the pattern (the recording's row reports this)."""
    try:
        return name_of(Path(task.path), task.names)
    except BadInput:
        return None
