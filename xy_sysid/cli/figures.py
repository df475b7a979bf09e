"""xy-sysid figures: every figure of a recording as vectors, and its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, say, say_refused
from xy_sysid.cli.reading import chosen, each, read, reads

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading

KINDS = ("svg", "pdf", "csv")


@reads
def figures(
    recs: o.Recs,
    reading: Reading,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="output folder, created if needed")] = Path("figures"),
    kind: Annotated[list[str] | None, typer.Option("--kind", metavar="KIND", help="svg, pdf or csv (may be repeated; default all three)")] = None,
    columns: Annotated[int, typer.Option("--columns", min=1, max=2, help="width: 1 (88 mm) or 2 (181 mm) columns of a journal")] = 2,
    effect_file: Own = None,
    budget: o.Budget = None,
    force: Annotated[bool, typer.Option("--force", help="replace existing pictures of these axes")] = False,
    json: o.Json = False,
) -> None:
    """Write all pictures of each axis as SVG, PDF and CSV, from the errors of the rigid model to the falling error."""
    from xy_sysid.errors import BadInput
    from xy_sysid.files.effects import library
    from xy_sysid.jit import cores
    from xy_sysid.report.axis_report import Wanted, told
    from xy_sysid.report.drawers import Drawers
    from xy_sysid.report.headline import headline

    kinds = tuple(dict.fromkeys(kind or KINDS))
    for one in kinds:
        if one not in KINDS:
            raise BadInput("--kind", repr(one), ", ".join(KINDS), "Choose one of these.")
    if out.exists() and not out.is_dir():
        raise BadInput("--out", str(out), "a folder", "Give another name.")
    wanted = Wanted(library=library(effect_file or []), budget=math.inf if budget is None else budget)
    recording = read(recs, reading, json)
    names = chosen(recording, reading.axes)
    if not force:
        _free(out, names, kinds)
    drawers = Drawers(kinds, columns, cores())
    with drawers:

        def work(name: str) -> dict[str, Any]:
            story = dict(told(recording, name, wanted))
            drawers.ask(name, story)
            return story

        found, refused = each(names, work)
        written = {name: _write(out, name, drawers.drawn(name)) for name in found}
    if json:
        emit({"folder": str(out), "files": written, "refused": refused, "notes": recording.notes})
        return
    for name, story in found.items():
        say(f"axis {name}: {headline(story)}. {len(written[name])} files.")
    say_refused(refused)
    say(f"wrote {sum(len(names) for names in written.values())} files into {out}")


def _plain(name: str) -> str:
    """axis_x, the start of a file name; an axis name from a recording cannot lead to another folder."""
    return "axis_" + re.sub(r"[/\\\0-\x1f]", "_", name)


def _free(out: Path, names: tuple[str, ...], kinds: tuple[str, ...]) -> None:
    """Raises BadInput if a figure of one of these axes exists, before any is drawn."""
    from glob import escape

    from xy_sysid.files.unasked import free

    for name in names:
        for kind in kinds:
            for path in out.glob(f"{escape(_plain(name))}_*.{kind}"):
                free("--out", path, force=False, act="add --force")


def _write(out: Path, name: str, drawn: Mapping[str, Mapping[str, bytes]]) -> list[str]:
    """Write the figures of an axis; returns the names of the files."""
    from xy_sysid.bags.atomic import whole

    out.mkdir(parents=True, exist_ok=True)
    made = {f"{_plain(name)}_{title}.{kind}": one for title, content in drawn.items() for kind, one in content.items()}
    for file, content in made.items():
        with whole(out / file) as part:
            part.write_bytes(content)
    return list(made)
