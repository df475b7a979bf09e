"""xy-sysid report: everything about a recording in one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, people, progress
from xy_sysid.cli.provenance import provenance
from xy_sysid.cli.reading import chosen, read
from xy_sysid.cli.study import answer as linear_answer
from xy_sysid.cli.study import write_page

if TYPE_CHECKING:
    from xy_sysid.recording import Recording
    from xy_sysid.report.axis_report import AxisReport


def report(
    rec: o.Rec,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="the page to write")] = Path("report.html"),
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    period: o.Period = "auto",
    span: o.Span = "",
    effect_file: Own = None,
    json: o.Json = False,
) -> None:
    """Everything in one self-contained page: summary, experiment, response, fits, checks, what is missing, the falling error."""
    from xy_sysid.report.axis_report import STAGES, axis_report
    from xy_sysid.report.report_page import report_page
    from xy_sysid.report.story_words import status
    from xy_sysid.user_effects import library

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    o.output_file("--out", out)
    known = library(effect_file or [])
    recording = read(rec, axis, topic, effort, span, json)
    names = chosen(recording, axis)
    made: dict[str, AxisReport] = {}
    with progress() as bar:
        task = bar.add_task("", total=len(names) * len(STAGES))
        for place, name in enumerate(names):

            def tell(stage: str, name: str = name, place: int = place) -> None:
                bar.update(task, description=f"axis {name}: {stage}", completed=place * len(STAGES) + STAGES.index(stage))

            made[name] = axis_report(recording, name, settings, samples, known, tell)
    origin = provenance(rec, recording)
    units = (recording.input_unit, recording.output_unit)
    page = report_page(rec.name, made, units, facts(recording, names), settings.min_coherence, {"Recording": origin}, recording.notes, known)
    write_page(out, page)
    if json:
        emit({"page": str(out), "bytes": len(page.encode()), "recording": origin, "axes": {name: answer(one) for name, one in made.items()}})
        return
    for name, one in made.items():
        sentence = one.problem if one.story is None else str(one.story["sentence"])
        people.print(f"axis {name}: {status(one.story)}. {sentence}", markup=False)
    people.print(f"wrote {out}, {len(page.encode()) / 1e6:.1f} MB")


def facts(recording: Recording, names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """What was recorded: (what, value)."""
    runs = recording.runs()
    longest = max((run.stop - run.start for run in runs), default=0)
    rate = float(recording.sampling_rate)
    return (
        ("axes", ", ".join(names)),
        ("sampling rate", f"{rate:.6g} Hz"),
        ("samples", str(len(recording))),
        ("duration", f"{len(recording) / rate:.4g} s"),
        ("gaps", str(max(len(runs) - 1, 0))),
        ("longest stretch without a gap", f"{longest / rate:.4g} s"),
        ("input", recording.input_unit),
        ("output", recording.output_unit),
    )


def answer(one: AxisReport) -> dict[str, Any]:
    """One axis of the JSON document."""
    from xy_sysid.report.story_words import status

    story = None if one.story is None else {name: value for name, value in one.story.items() if name not in ("steps", "measured")}
    verdicts = None if one.verdicts is None else {check.name: {"ok": check.ok, "sentence": check.sentence} for check in one.verdicts.verdicts}
    return {"status": status(one.story), "problem": one.problem, "story": story, "linear": linear_answer(one.study), "checks": verdicts}
