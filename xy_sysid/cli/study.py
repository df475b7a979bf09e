"""xy-sysid study: the figures and tables of the paper for any recording, as one page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import aside, emit, progress, say
from xy_sysid.cli.reading import chosen, read, reads
from xy_sysid.files.provenance import provenance

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading
    from xy_sysid.paper.study import AxisStudy
    from xy_sysid.samples.recording import Recording


@reads
def study(
    rec: o.Rec,
    reading: Reading,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="FILE", help="the page to write")] = Path("study.html"),
    loose: Annotated[
        Path | None, typer.Option("--loose", metavar="REC2", help="second recording of the same machine (bolts loosened): the shift of the resonance")
    ] = None,
    loose_span: Annotated[str, typer.Option("--loose-span", metavar="FROM:TO", help="only this part of REC2, in seconds from its start")] = "",
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Repeat the study of the paper (figures 2-7, tables 1-2) on any recording, as one HTML page that opens offline."""
    from xy_sysid.bags.atomic import write_text
    from xy_sysid.errors import BadInput
    from xy_sysid.paper.document import document
    from xy_sysid.paper.study import study_axis
    from xy_sysid.paper.study_page import study_page
    from xy_sysid.report.captions import summary

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    o.output_file("--out", out, force)
    if loose_span and loose is None:
        raise BadInput("--loose-span", repr(loose_span), "only together with --loose", "Give the second recording too.")
    start, stop = o.span_from(loose_span)
    recording = read([rec], reading, json)
    names = chosen(recording, reading.axes)
    second = read([loose], replace(reading, start=start, stop=stop), json) if loose is not None else None
    if second is not None:
        _same_machine(recording, second, names)
    studies: dict[str, AxisStudy] = {}
    with progress() as bar:
        task = bar.add_task("studying", total=len(names))
        for name in names:
            studies[name] = study_axis(recording, name, settings, samples, second)
            bar.advance(task)
    _any(studies)
    origins: dict[str, dict[str, Any]] = {"Recording": provenance(str(rec), recording)}
    if loose is not None and second is not None:
        origins["Second recording (after)"] = provenance(str(loose), second)
    units = recording.units
    page = study_page(rec.name, studies, units, settings.min_coherence, origins, recording.notes)
    write_text(out, page)
    if json:
        emit({"page": str(out), "bytes": len(page.encode()), "recordings": origins, "axes": {name: document(one) for name, one in studies.items()}})
        return
    for one in studies.values():
        say(summary(one))
    for one in studies.values():
        for note in one.estimate.notes if one.estimate else ():
            say(f"axis {one.axis}: {note}", aside)
    say(f"wrote {out}, {len(page.encode()) / 1e6:.1f} MB")


def _same_machine(first: Recording, second: Recording, names: tuple[str, ...]) -> None:
    from xy_sysid.errors import BadInput

    missing = [name for name in names if name not in second.axes]
    if missing:
        raise BadInput("axes of --loose", ", ".join(second.axes), f"at least {', '.join(names)}", "Give a recording of the same machine.")
    if (first.input_unit, first.output_unit) != (second.input_unit, second.output_unit):
        given, wanted = f"{second.input_unit}, {second.output_unit}", f"{first.input_unit}, {first.output_unit}"
        raise BadInput("units of --loose", given, wanted, "Give a recording of the same machine.")


def _any(studies: dict[str, AxisStudy]) -> None:
    """Raises BadInput with the reason if no axis has a response: the page would be empty."""
    from xy_sysid.errors import BadInput

    if all(one.frf is None for one in studies.values()):
        first = next(iter(studies.values()))
        raise BadInput("recording", "without a response on any axis", "one with an excited axis that moves", first.problem)
