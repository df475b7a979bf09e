"""xy-sysid report: all results of a recording in one page."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, progress, say
from xy_sysid.cli.reading import chosen, read, reads

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading
    from xy_sysid.report.axis_report import AxisReport
    from xy_sysid.response.coupling import Coupling


@reads
def report(
    recs: o.Recs,
    reading: Reading,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="the page to write")] = Path("report.html"),
    title: Annotated[str, typer.Option("--title", metavar="TEXT", help="title of the report. Default: the name of the recording")] = "",
    machine: Annotated[str, typer.Option("--machine", metavar="TEXT", help="name of the machine. Default: from the meta data of the recording")] = "",
    author: Annotated[str, typer.Option("--author", metavar="TEXT", help="author of the report")] = "",
    recorded: Annotated[
        str, typer.Option("--date", metavar="DATE", help="date of the recording, for example 2026-03-03. Default: from its clock or its name")
    ] = "",
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    effect_file: Own = None,
    budget: o.Budget = None,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Write one self-contained page: summary, experiment, response, fits, checks, missing effects and the falling error.

    The browser prints it with page numbers.
    """
    from xy_sysid.processes.helper import Helper

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    o.output_file("--out", out, force)
    with Helper("xy_sysid.report.axis_report") as helper:
        from xy_sysid.bags.atomic import write_text
        from xy_sysid.files.effects import library
        from xy_sysid.fleets.naming import date_of
        from xy_sysid.report.axis_report import STAGES, Wanted
        from xy_sysid.report.cover import Cover
        from xy_sysid.report.story_words import status
        from xy_sysid.report.written import Asked, written_report

        if recorded:
            date_of(recorded)
        wanted = Wanted(settings, samples, library(effect_file or []), math.inf if budget is None else budget)
        cover = Cover(title=title, machine=machine, author=author, recorded=recorded)
        recording = read(recs, reading, json)
        names = chosen(recording, reading.axes)
        with progress() as bar:
            tasks = {name: bar.add_task(f"axis {name}", total=len(STAGES)) for name in names}

            def tell(name: str, stage: str) -> None:
                bar.update(tasks[name], description=f"axis {name}: {stage}", completed=STAGES.index(stage))

            asked = Asked(paths=tuple(recs), axes=names, cover=cover, wanted=wanted, tell=tell, begin=helper.begin)
            made = written_report(recording, asked)
    write_text(out, made.page)
    if json:
        head: dict[str, Any] = {"title": made.cover.title, "machine": made.cover.machine, "author": made.cover.author, "date": made.cover.recorded}
        axes = {name: answer(one) for name, one in made.axes.items()}
        head |= {"recording": made.origin, "axes": axes, "coupling": _coupled(made.coupling)}
        emit({"page": str(out), "bytes": len(made.page.encode()), **head})
        return
    for name, one in made.axes.items():
        sentence = one.problem if one.story is None else str(one.story["sentence"])
        say(f"axis {name}: {status(one.story)}. {sentence}")
    if made.coupling is not None:
        say(made.coupling.sentence)
    say(f"wrote {out}, {len(made.page.encode()) / 1e6:.1f} MB")


def _coupled(found: Coupling | None) -> dict[str, Any] | None:
    return None if found is None else {"sentence": found.sentence, "suffice": found.suffice, "largest": found.largest}


def answer(one: AxisReport) -> dict[str, Any]:
    """One axis of the JSON document."""
    from xy_sysid.report.fits_document import fits_document
    from xy_sysid.report.remarks import axis_remarks
    from xy_sysid.report.story_words import status

    linear = fits_document(one.study, axis_remarks(one.study))
    story = None if one.story is None else {name: value for name, value in one.story.items() if name not in ("steps", "measured")}
    verdicts = None if one.verdicts is None else {check.name: {"ok": check.ok, "sentence": check.sentence} for check in one.verdicts.verdicts}
    return {"status": status(one.story), "problem": one.problem, "story": story, "linear": linear, "checks": verdicts}
