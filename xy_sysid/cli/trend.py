"""xy-sysid trend: changed axes, with date, size, certainty and likely cause."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import emit, progress, say, table
from xy_sysid.cli.reading import reads

if TYPE_CHECKING:
    from xy_sysid.fleets.history import Axis
    from xy_sysid.fleets.trends import Event, Moved, Trend, Trends
    from xy_sysid.imports.reading import Reading

SHOWN = 12  # parameters whose spread is printed


@reads
def trend(
    folder: Annotated[Path, typer.Argument(metavar="TABLE", help="the folder that xy-sysid fleet made; with --every a recording")],
    reading: Reading,
    every: Annotated[str, typer.Option(metavar="TIME", help="compare parts of one long recording; length of a part: 10min, 90s, 1h")] = "",
    machine: Annotated[list[str] | None, typer.Option("--machine", "-m", metavar="NAME", help="only this machine (may be repeated)")] = None,
    causes: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML that adds to the table of changes and their causes (docs/fleet.md)")
    ] = None,
    names: Annotated[
        Path | None, typer.Option(metavar="FILE", help="with --every: YAML with the names of the recording and the followed effects, as for fleet")
    ] = None,
    effect_file: Own = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE.html", help="write a page with every parameter over time")] = None,
    axis_months: Annotated[
        float, typer.Option(metavar="N", min=1e-3, help="months of an unchanged axis in which one false alarm is allowed")
    ] = 1000.0,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Find changes of every parameter of every axis over time: since when, by how much, how certain, and the likely cause."""
    from xy_sysid.errors import BadInput
    from xy_sysid.fleets.causes import causes as causes_of
    from xy_sysid.fleets.history import FEWEST
    from xy_sysid.fleets.naming import Names, names_from
    from xy_sysid.fleets.of_paths import Analysis
    from xy_sysid.fleets.parts import rows_of_parts, seconds
    from xy_sysid.fleets.trends import of_rows
    from xy_sysid.fleets.trends import trend as logic
    from xy_sysid.fleets.words import gaps, percent, sentence, summary, widest
    from xy_sysid.imports.reading import Reading

    o.output_file("--out", out, force, ".html")
    if not every and (names or effect_file or reading != Reading()):
        options = "--names, --effect-file or an option for reading a file"
        raise BadInput(options, "without --every", "with a recording", "A table has its names, effects, axes and units already.")
    if not math.isfinite(axis_months):
        raise BadInput("--axis-months", axis_months, "a finite number", "Leave it out, or write for example 1000.")
    with progress() as bar:
        task = bar.add_task("comparing recordings", total=1.0)
        if every:
            known = causes_of(causes)
            how = Analysis(names_from(names) if names is not None else Names(), reading, tuple(map(str, effect_file or ())))
            parts = rows_of_parts(folder, seconds(every), how, lambda number: bar.update(task, description=f"part {number}"))
            if max(Counter(row["axis"] for row in parts).values(), default=0) < FEWEST:
                raise BadInput("--every", repr(every), f"a time that divides the recording into {FEWEST} parts or more", "Choose a shorter time.")
            found = of_rows(parts, {name for row in parts for name in row}, known, axis_months, machines=machine or ())
        else:
            found = logic(
                folder, machines=machine or (), own_causes=causes, axis_months=axis_months, tell=lambda part: bar.update(task, completed=part)
            )
    if out is not None:
        from xy_sysid.bags.atomic import write_text
        from xy_sysid.report.trend_page import trend_page

        write_text(out, trend_page(found, folder.name))
    if json:
        emit(answer(found))
        return
    axes = {(one.machine, one.axis): one for one in found.axes}
    say(f"{folder}: {summary(found)}.")
    for text in gaps(found):
        say(text)
    for event in found.events:
        say(f"- {sentence(event, axes[event.machine, event.axis])}")
    if not found.events:
        say("Nothing changed.")
    rows = [(name, percent(between), percent(own)) for name, between, own in widest(found)[:SHOWN]]
    table("spread between recordings (it is in the intervals)", ("parameter", "between recordings", "within one"), rows)
    if out is not None:
        say(f"wrote {out}")


def answer(found: Trends) -> dict[str, Any]:
    """The JSON document."""
    from xy_sysid.fleets.history import FEWEST

    axes = {(one.machine, one.axis): one for one in found.axes}
    return {
        "axes": [
            {
                "machine": one.machine,
                "axis": one.axis,
                "recordings": len(one.dates),
                "months": one.months,
                "left_out": one.left_out,
                "other_units": one.other_units,
                "newest_without_answer": one.silent,
                "compared": len(one.dates) >= FEWEST,
            }
            for one in found.axes
        ],
        "unread": [{"machine": one.machine, "recordings": one.recordings, "newest": one.newest} for one in found.unread],
        "events": [_event(one, axes[one.machine, one.axis]) for one in found.events],
        "parameters": [_trend(one) for one in found.trends],
    }


def _event(one: Event, axis: Axis) -> dict[str, Any]:
    from xy_sysid.fleets.words import sentence

    cause = None if one.cause is None else {"cause": one.cause.cause, "check": one.cause.check}
    changes = [_moved(each, axis) for each in one.moved]
    return {
        "machine": one.machine,
        "axis": one.axis,
        "since": str(one.since),
        "sentence": sentence(one, axis),
        "cause": cause,
        "changes": changes,
    }


def _moved(one: Moved, axis: Axis) -> dict[str, Any]:
    from xy_sysid.fleets.words import told

    dates = {name: str(getattr(one, name)) for name in ("since", "earliest", "latest", "declared")}
    numbers = {"before": one.before, "after": one.after, "ci95": [one.low, one.high], "part": one.part, "sigmas": one.sigmas}
    how = {"duration_days": one.duration, "once_in_axis_months": one.one_in, "sentence": f"{told(one, axis)}."}
    return {"parameter": one.column, "unit": one.unit, "direction": one.direction, **numbers, **dates, **how}


def _trend(one: Trend) -> dict[str, Any]:
    history = one.history
    return {
        "machine": one.machine,
        "axis": one.axis,
        "parameter": history.column,
        "unit": history.unit,
        "dates": [str(date) for date in history.dates],
        "values": history.value,
        "ci95": np.column_stack((one.low, one.high)),
        "ci95_of_the_recording": np.column_stack((history.low, history.high)),
        "spread_between_recordings": one.spread,
        "next_ci95": list(one.next),
        "changed": bool(one.moved),
    }
