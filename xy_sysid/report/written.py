"""The report as a page, for ``xy-sysid report`` and for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from xy_sysid.bags.atomic import write_text
from xy_sysid.errors import BadInput
from xy_sysid.files.provenance import provenance
from xy_sysid.files.unasked import free
from xy_sysid.fitting.two_axes import coupling_in
from xy_sysid.report.axis_report import AxisReport, Begin, Tell, Wanted, axis_reports, later
from xy_sysid.report.cover import Cover, cover_of
from xy_sysid.report.report_page import Recorded, report_page
from xy_sysid.response.coupling import Coupling
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import IdentifierSettings


@dataclass(frozen=True, slots=True)
class Written:
    """A finished report. page: HTML; axes: the report of each axis; cover: its head; origin: provenance of the numbers.

    coupling: how the first two axes affect each other, or None
    """

    page: str
    axes: dict[str, AxisReport]
    cover: Cover
    origin: dict[str, Any]
    coupling: Coupling | None


@dataclass(frozen=True, slots=True)
class Asked:
    """A requested report.

    paths: of the recording; axes: to report on; cover: given entries; command: the command line; begin: see ``axis_reports``
    """

    paths: tuple[Path, ...]
    axes: tuple[str, ...]
    cover: Cover
    wanted: Wanted
    command: str = ""
    tell: Tell = field(default=lambda axis, stage: None)
    begin: Begin = later


def written_report(recording: Recording, asked: Asked) -> Written:
    """The report. Raises BadInput for an invalid date, before any computation."""
    cover = cover_of(recording, asked.cover, asked.paths, datetime.now(UTC).astimezone().date())
    made = axis_reports(recording, asked.axes, asked.wanted, asked.tell, asked.begin)
    source = ", ".join(str(path) for path in asked.paths) or recording.source
    origin = provenance(source, recording) | ({"command": asked.command} if asked.command else {})
    coupling, why = coupled(recording, asked.axes, asked.wanted.settings)
    told = Recorded(
        cover=cover,
        units=recording.units,
        facts=facts(recording, asked.axes),
        origins={"Recording": origin},
        notes=(*recording.notes, *why),
        coupling=coupling,
    )
    page = report_page(told, made, asked.wanted.settings.min_coherence, asked.wanted.library)
    return Written(page=page, axes=made, cover=cover, origin=origin, coupling=coupling)


def write_report(
    data: Run | Recording,
    path: Path | str = "report.html",
    *,
    title: str = "",
    machine: str = "",
    author: str = "",
    recorded: str | date = "",
    budget: float = math.inf,
    force: bool = False,
) -> None:
    """Write the report of a recording as one HTML page that opens offline and prints with page numbers.

    title, machine, author: words for its head; the machine is by default the one that the recording names in its meta data
    recorded: the date, as 2026-03-03 or 2026-03-03T14:30:00; by default from the recording's clock or its file name
    budget: processor time for the diagnosis of each axis, s; force: replace the file
    Raises BadInput if the file exists and ``force`` is False, and for an invalid date.
    """
    path = Path(path)
    free("file", path, force, "say force=True")
    recording = data.recording() if isinstance(data, Run) else data
    paths = (Path(recording.source),) if recording.source and Path(recording.source).exists() else ()
    cover = Cover(title=title, machine=machine, author=author, recorded=str(recorded))
    asked = Asked(paths=paths, axes=recording.axes, cover=cover, wanted=Wanted(budget=budget), command="xy_sysid.write_report")
    write_text(path, written_report(recording, asked).page)


def coupled(recording: Recording, names: tuple[str, ...], settings: IdentifierSettings) -> tuple[Coupling | None, tuple[str, ...]]:
    """How the first two axes affect each other, and notes; if the coupling is None, a note gives the reason."""
    if len(names) < 2:
        return None, ()
    try:
        return coupling_in(recording.of_axes(names[:2]), settings), ()
    except BadInput as problem:
        return None, (f"Coupling of {names[0]} and {names[1]} was not judged: {problem}",)


def facts(recording: Recording, names: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Facts of the recording: (label, value)."""
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
