"""xy-sysid report: everything about a recording in one page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, progress, say
from xy_sysid.cli.provenance import provenance
from xy_sysid.cli.reading import chosen, named, read, reads
from xy_sysid.cli.study import answer as linear_answer

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading
    from xy_sysid.report.axis_report import AxisReport
    from xy_sysid.response.coupling import Coupling
    from xy_sysid.samples.recording import Recording
    from xy_sysid.settings import IdentifierSettings


@reads
def report(
    recs: o.Recs,
    reading: Reading,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="the page to write")] = Path("report.html"),
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    effect_file: Own = None,
    budget: o.Budget = None,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Write one self-contained page: summary, experiment, response, fits, checks, missing effects and the falling error."""
    from xy_sysid.bags.atomic import write_text
    from xy_sysid.files.effects import library
    from xy_sysid.report.axis_report import STAGES, Wanted, axis_reports
    from xy_sysid.report.report_page import Recorded, report_page
    from xy_sysid.report.story_words import status

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    o.output_file("--out", out, force)
    known = library(effect_file or [])
    recording = read(recs, reading, json)
    names = chosen(recording, reading.axes)
    with progress() as bar:
        tasks = {name: bar.add_task(f"axis {name}", total=len(STAGES)) for name in names}

        def tell(name: str, stage: str) -> None:
            bar.update(tasks[name], description=f"axis {name}: {stage}", completed=STAGES.index(stage))

        made = axis_reports(recording, names, Wanted(settings, samples, known, math.inf if budget is None else budget), tell)
    origin = provenance(named(recs), recording)
    units = recording.units
    title = ", ".join(rec.name for rec in recs)
    found, why = coupled(recording, names, settings)
    told = Recorded(
        title=title,
        units=units,
        facts=facts(recording, names),
        origins={"Recording": origin},
        notes=(*recording.notes, *why),
        coupling=found,
    )
    page = report_page(told, made, settings.min_coherence, known)
    write_text(out, page)
    if json:
        emit(
            {
                "page": str(out),
                "bytes": len(page.encode()),
                "recording": origin,
                "axes": {name: answer(one) for name, one in made.items()},
                "coupling": None if found is None else {"sentence": found.sentence, "suffice": found.suffice, "largest": found.largest},
            }
        )
        return
    for name, one in made.items():
        sentence = one.problem if one.story is None else str(one.story["sentence"])
        say(f"axis {name}: {status(one.story)}. {sentence}")
    if found is not None:
        say(found.sentence)
    say(f"wrote {out}, {len(page.encode()) / 1e6:.1f} MB")


def coupled(recording: Recording, names: tuple[str, ...], settings: IdentifierSettings) -> tuple[Coupling | None, tuple[str, ...]]:
    """What the first two of the axes do to each other, and notes; without an answer a note says why."""
    from xy_sysid.errors import BadInput
    from xy_sysid.fitting.two_axes import coupling_in

    if len(names) < 2:
        return None, ()
    columns = [recording.axes.index(name) for name in names[:2]]
    two = replace(recording, axes=names[:2], voltage=recording.voltage[:, columns], position=recording.position[:, columns], reference=None)
    try:
        return coupling_in(two, settings), ()
    except BadInput as problem:
        return None, (f"Coupling of {names[0]} and {names[1]} was not judged: {problem}",)


def facts(recording: Recording, names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """What was recorded: (what, value)."""
    runs = recording.runs()
    longest = recording.run(names[0]).seconds if names and len(recording) else 0.0
    rate = float(recording.sampling_rate)
    return (
        ("axes", ", ".join(names)),
        ("sampling rate", f"{rate:.6g} Hz"),
        ("samples", str(len(recording))),
        ("duration", f"{len(recording) / rate:.4g} s"),
        ("gaps", str(max(len(runs) - 1, 0))),
        ("longest stretch without a gap", f"{longest:.4g} s"),
        ("input", recording.input_unit),
        ("output", recording.output_unit if recording.measured == "position" else f"{recording.output_unit}, from a measured {recording.measured}"),
    )


def answer(one: AxisReport) -> dict[str, Any]:
    """One axis of the JSON document."""
    from xy_sysid.report.story_words import status

    story = None if one.story is None else {name: value for name, value in one.story.items() if name not in ("steps", "measured")}
    verdicts = None if one.verdicts is None else {check.name: {"ok": check.ok, "sentence": check.sentence} for check in one.verdicts.verdicts}
    return {"status": status(one.story), "problem": one.problem, "story": story, "linear": linear_answer(one.study), "checks": verdicts}
