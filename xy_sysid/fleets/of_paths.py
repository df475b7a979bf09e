"""Recordings -> the fleet's table, in one call."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING

from xy_sysid.errors import BadInput
from xy_sysid.files.effects import library
from xy_sysid.fleets.engine import Cluster, connected, dask, processes, results
from xy_sysid.fleets.estimate import Progress
from xy_sysid.fleets.finding import recordings
from xy_sysid.fleets.journal import journal
from xy_sysid.fleets.naming import Names, check, fits, unused
from xy_sysid.fleets.of_file import Done, Task, rows_of_file
from xy_sysid.fleets.reference import COLUMNS, References
from xy_sysid.fleets.table import Known, arrow, as_table, read, rows_so_far
from xy_sysid.imports.reading import Reading

if TYPE_CHECKING:
    import pyarrow
    from distributed import Client

Paths = Iterable[Path | str] | Path | str


@dataclass(frozen=True, slots=True)
class Analysis:
    """How recordings are named, read and analysed: see ``naming.Names`` and ``imports.Reading``; effect_files: your own effects."""

    names: Names = field(default_factory=Names)
    reading: Reading = field(default_factory=Reading)
    effect_files: tuple[str, ...] = ()

    def task(self, path: Path) -> Task:
        """The task for one recording, for any process: its paths are absolute."""
        own = tuple(str(Path(file).expanduser().absolute()) for file in self.effect_files)
        return Task(path=str(path.absolute()), names=self.names, reading=self.reading, effect_files=own)

    def check(self) -> None:
        """Raises BadInput for unknown names of effects, an invalid pattern or an invalid date, before any work."""
        known = library(self.effect_files)
        for name in self.names.follow:
            if known[name].category == "base":
                raise BadInput("follow", name, "an effect that is not in every model already", "Leave it out.")
        check(self.names)


def fleet(
    paths: Paths,
    table: Path | str | None = None,
    client: Client | None = None,
    *,
    pattern: str = "",
    follow: Iterable[str] = (),
    workers: int = 0,
) -> pyarrow.Table:
    """Fit and diagnose every recording; returns the table of all results: one row for each axis of each recording.

    paths:   recordings, folders or patterns; table: a folder. Recordings in it are skipped. Without a folder nothing is saved
    client:  of a dask cluster; by default processes on this machine: ``workers``, or one per core
    pattern: for the end of a path, with machine, axis and date: "{machine}/{date}*.csv"
    follow:  effects whose parameters are estimated in every recording
    Raises BadInput or BadRecording if the call cannot be carried out; an unreadable recording becomes a row with its problem.
    """
    names = Names(pattern=pattern, follow=[follow] if isinstance(follow, str) else list(follow))
    with TemporaryDirectory() as kept_for_now:
        folder = Path(kept_for_now if table is None else table)
        run(paths, folder, Analysis(names=names), client or Cluster(workers=workers))
        return read(folder)


def run(paths: Paths, folder: Path, how: Analysis, where: Cluster | Client, tell: Callable[[Progress], None] = lambda _: None) -> Progress:
    """Update the table; ``tell`` is called after every recording. Finished rows are in the table even if the run is interrupted."""
    arrow()
    dask()
    how.check()
    found = recordings([paths] if isinstance(paths, (str, Path)) else paths, folder)
    fits(how.names, found)
    with journal(folder, library(how.effect_files)) as kept, ExitStack() as stack:
        before = rows_so_far(folder, COLUMNS)
        known = Known(before, {str(path) for path in found})
        tasks = [dataclasses.replace(how.task(path), known=known.of(path)) for path in found]
        client = stack.enter_context(connected(where)) if isinstance(where, Cluster) else where
        now = Progress(total=len(tasks), workers=processes(client), place=client.dashboard_link, unused=unused(how.names, found))
        tell(now)
        begun = perf_counter()
        for done, seconds in _in_order(client, References(tasks, before)):
            kept.add(done.rows)
            worked = 0.0 if done.unchanged else seconds
            now = dataclasses.replace(
                now,
                done=now.done + 1,
                workers=now.workers or processes(client),
                unchanged=now.unchanged + done.unchanged,
                failed=now.failed + any(row.get("problem") for row in done.rows),
                elapsed=perf_counter() - begun,
                spent=now.spent + worked,
                square=now.square + worked**2,
            )
            tell(now)
    return now


def _in_order(client: Client, references: References) -> Iterator[tuple[Done, float]]:
    """(result, duration in s) of each task: first the first recordings of all machines, then the others."""
    while tasks := references.next():
        for done, seconds in results(client, tasks):
            references.hear(done)
            yield done, seconds
    yield from results(client, references.rest())


def one(path: Path, how: Analysis) -> pyarrow.Table:
    """The rows of one recording, computed in this process."""
    arrow()
    how.check()
    return as_table(rows_of_file(how.task(path)).rows, library(how.effect_files))
