"""xy-sysid columns: the content of a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, people, say

if TYPE_CHECKING:
    from xy_sysid.imports.listing import Listed, Listing

MOST = 60  # rows shown


def columns(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="a recording, a table or a rosbag2 (docs/files.md lists the formats)")],
    json: o.Json = False,
) -> None:
    """List the columns, arrays or topics of a file, how xy-sysid would use each, and the options that change it."""
    from xy_sysid.errors import BadRecording
    from xy_sysid.imports.listing import listing

    try:
        found = listing(file)
    except OSError as error:
        raise BadRecording(file, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
    if json:
        emit(
            {
                "file": str(file),
                "kind": found.kind,
                "columns": found.columns,
                "reads": found.reads or None,
                "problem": found.problem or None,
                "notes": found.notes,
            }
        )
        return
    say(f"{file}: {found.kind}", style="bold")
    head = ("number", "name", "unit", "rows", "first", "least", "most", "taken as, looks like")
    rows = [head, *(_row(number, one) for number, one in enumerate(found.columns[:MOST], 1))]
    widths = [max(len(row[place]) for row in rows) for place in range(len(head))]
    for row in rows:
        say("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
    if len(found.columns) > MOST:
        say(f"... and {len(found.columns) - MOST} more (--json has all)")
    _words(file, found)


def _row(number: int, one: Listed) -> tuple[str, ...]:
    figures = ["" if value is None else f"{value:.6g}" if isinstance(value, float) else value[:40] for value in (one.first, one.low, one.high)]
    return str(number), one.name, one.unit, str(one.rows), *figures, ", ".join(text for text in (one.role, one.looks) if text)


def _words(file: Path, found: Listing) -> None:
    for note in found.notes:
        say(f"note: {note}")
    if found.reads:
        say(f"Reads as: {found.reads}.")
        return
    say(f"Needs options to be read: {found.problem}")
    if found.kind != "bag":
        clock = next((one.name for one in found.columns if one.looks.startswith("a clock")), "COLUMN")
        people.print(f"Assign the columns by name or number: xy-sysid diagnose {file} --map time={clock},input=COLUMN,output=COLUMN --unit output=mm")
