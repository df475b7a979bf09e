"""Read the recording that a command was given, with progress."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from xy_sysid.cli.options import span_from, topics_from
from xy_sysid.cli.output import aside, progress
from xy_sysid.errors import BadInput
from xy_sysid.recording import Recording

Found = TypeVar("Found")
TABLES = (".csv", ".txt", ".tsv", ".npz", ".mat")


def read(path: Path, axes: list[str] | None, topics: list[str] | None, effort: bool, span: str, quiet: bool) -> Recording:
    """The recording; its notes go to stderr unless ``quiet``."""
    from xy_sysid.imports import load

    start, stop = span_from(span)
    if (topics or effort) and path.suffix.lower() in TABLES:
        raise BadInput("--topic or --effort", f"for {path}", "for a bag", "A table has columns: leave it out.")
    with progress() as bar:
        task = bar.add_task(f"reading {path.name}", total=1.0)
        recording = load(
            path,
            axes=tuple(axes) if axes else None,
            effort_as_voltage=effort,
            start=start,
            stop=stop,
            progress=lambda part: bar.update(task, completed=part),
            **topics_from(topics),
        )
    if not quiet:
        for note in recording.notes:
            aside.print(f"note: {note}")
    return recording


def chosen(recording: Recording, axes: list[str] | None) -> tuple[str, ...]:
    """The axes asked for; raises BadInput for one that is not there."""
    for name in axes or []:
        if name not in recording.axes:
            raise BadInput("--axis", repr(name), ", ".join(recording.axes), "Choose one of these.")
    return tuple(axes) if axes else recording.axes


def each(names: tuple[str, ...], work: Callable[[str], Found]) -> tuple[dict[str, Found], dict[str, str]]:
    """What ``work`` finds for each axis, and why there is nothing for the others; raises the first refusal if no axis has an answer."""
    found: dict[str, Found] = {}
    refusals: dict[str, BadInput] = {}
    with progress() as bar:
        task = bar.add_task("", total=len(names))
        for name in names:
            bar.update(task, description=f"axis {name}")
            try:
                found[name] = work(name)
            except BadInput as refusal:
                refusals[name] = refusal
            bar.advance(task)
    if not found:
        raise next(iter(refusals.values()))
    return found, {name: str(refusal) for name, refusal in refusals.items()}
