"""xy-sysid fleet: fit and diagnose many recordings of many machines, into one table."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, plain, progress, say
from xy_sysid.cli.reading import reads

if TYPE_CHECKING:
    from xy_sysid.fleets.estimate import Progress
    from xy_sysid.fleets.of_paths import Analysis
    from xy_sysid.imports.reading import Reading

Follow = Annotated[
    list[str] | None,
    typer.Option(
        "--follow",
        metavar="EFFECT",
        help="estimate this effect in every recording, even where it is not found, so that its trend is complete (may be repeated)",
    ),
]
EVERY = 30.0  # s between two lines of progress without a terminal


@reads
def fleet(
    reading: Reading,
    paths: Annotated[
        list[Path] | None, typer.Argument(metavar="PATH", help="recordings, folders with recordings, or patterns in quotes, as 'data/*/2026*.csv'")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="TABLE", help="folder of Parquet files; recordings that are already in it are skipped")
    ] = None,
    one: Annotated[
        Path | None, typer.Option("--one", metavar="FILE", help="analyse only this recording, in this process; -o then names a Parquet file")
    ] = None,
    pattern: Annotated[
        str,
        typer.Option(metavar="PATTERN", help="pattern of the end of a path: {machine}, {axis}, {date} and *, for example '{machine}/{date}*.csv'"),
    ] = "",
    names: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML with pattern, follow, and the names of single recordings (docs/fleet.md)")
    ] = None,
    follow: Follow = None,
    effect_file: Own = None,
    workers: Annotated[int, typer.Option(metavar="N", min=0, max=1024, help="processes on this machine; 0: one for each core")] = 0,
    scheduler: Annotated[str, typer.Option(metavar="ADDRESS", help="use the dask cluster of this scheduler: tcp://HOST:PORT")] = "",
    force: Annotated[bool, typer.Option("--force", help="with --one: replace an existing file")] = False,
    json: o.Json = False,
) -> None:
    """Fit and diagnose every recording, and write one row for each axis of each into a table (Parquet)."""
    from xy_sysid.errors import BadInput
    from xy_sysid.fleets.engine import Cluster
    from xy_sysid.fleets.naming import Names, names_from
    from xy_sysid.fleets.of_paths import Analysis, run

    said = names_from(names) if names is not None else Names()
    said = said.model_copy(update={"pattern": pattern or said.pattern, "follow": [*said.follow, *(follow or [])]})
    how = Analysis(names=said, reading=reading, effect_files=tuple(map(str, effect_file or ())))
    if one is not None:
        if paths or workers or scheduler:
            raise BadInput("PATH, --workers or --scheduler", "given with --one", "one recording in this process", "Leave out one of them.")
        if not one.exists():
            raise BadInput("--one", str(one), "a recording that exists", "Check the path.")
        _one(one, out, how, force)
        return
    if force:
        raise BadInput("--force", "given without --one", "with --one", "Leave it out: a table is updated, not replaced.")
    if not paths or out is None:
        raise BadInput("PATH or -o", "missing", "recordings or folders, and the table's folder", "Write: xy-sysid fleet PATH... -o TABLE.")
    if out.is_file():
        raise BadInput("-o", str(out), "a folder, and this is a file", "Give the table another name.")
    begun, last = time.perf_counter(), [time.perf_counter()]
    with progress() as bar:
        task = bar.add_task("starting the processes", total=None)

        def tell(now: Progress) -> None:
            bar.update(task, description=now.sentence(), total=now.total, completed=now.done)
            if now.done == 0 and now.place:
                many, on = "" if now.total == 1 else "s", "" if now.workers == 1 else "es"
                where = f" on {now.workers} process{on}" if now.workers else ", waiting for workers of the scheduler"
                aside.print(f"{now.total} recording{many}{where}; dashboard: {now.place}")
            elif bar.disable and time.perf_counter() - last[0] > EVERY:
                last[0] = time.perf_counter()
                aside.print(now.sentence())

        now = run(paths, out, how, Cluster(workers, scheduler), tell)
    if json:
        counts = {"recordings": now.total, "analysed": now.analysed, "unchanged": now.unchanged, "without_an_answer": now.failed}
        emit({"table": str(out), **counts, "an_hour": now.rate, "seconds": time.perf_counter() - begun})
        return
    say(f"{out}: {now.sentence()}.")
    if now.failed:
        say("  The columns problem and stage say why there is no answer.")
    if now.unused:
        say(f"  Entries of {names} that fit no recording: {', '.join(now.unused)}.")


def _one(path: Path, out: Path | None, how: Analysis, force: bool) -> None:
    """Rows of one recording: to a Parquet file, or as one JSON document."""
    from xy_sysid.fleets.of_file import rows_of_file
    from xy_sysid.fleets.of_paths import one
    from xy_sysid.fleets.table import write

    if out is None:
        how.check()
        rows = [
            {name: str(value) if name == "date" and value else plain(value) for name, value in row.items()}
            for row in rows_of_file(how.task(path)).rows
        ]
        emit({"rows": rows})
        return
    o.output_file("--out", out, force, ".parquet")
    table = one(path, how)
    write(table, out)
    say(f"{out}: {table.num_rows} row{'s' if table.num_rows != 1 else ''} of {path}.")
