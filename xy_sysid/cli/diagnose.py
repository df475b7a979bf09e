"""xy-sysid diagnose: which physical effect is missing?"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.mechanics import Gear, Kt, mechanics_document, mechanics_table
from xy_sysid.cli.output import emit, estimate, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, notes_of, read_each, reads, runs_of
from xy_sysid.units import motion

if TYPE_CHECKING:
    from xy_sysid.axis.mechanics import Transmission
    from xy_sysid.diagnosis.answer import Answer, Rung
    from xy_sysid.imports.reading import Reading
    from xy_sysid.response.estimate import Estimate

Own = Annotated[list[Path] | None, typer.Option("--effect-file", metavar="FILE", help="a Python file with an effect of your own (may be repeated)")]


@reads
def diagnose(
    recs: o.Recs,
    reading: Reading,
    effect_file: Own = None,
    kt: Kt = None,
    gear: Gear = "",
    budget: o.Budget = None,
    json: o.Json = False,
) -> None:
    """Name the physical effect that the rigid model of each axis misses, with evidence, or report that no known effect explains the error."""
    from xy_sysid.axis.mechanics import drive_from
    from xy_sysid.diagnosis.as_json import answer_document
    from xy_sysid.diagnosis.of_run import diagnose as logic
    from xy_sysid.files.effects import library

    begun = time.perf_counter()
    known = library(effect_file or [])
    recordings = read_each(recs, reading, json)
    recording = recordings[0]
    names = chosen(recording, reading.axes)
    drive = drive_from(kt, gear, recording.units)
    limit = math.inf if budget is None else budget
    found, refused = each(names, lambda name: logic(runs_of(recordings, name), known, limit, time.process_time), "diagnosing ")
    seconds = time.perf_counter() - begun
    if json:
        answers: dict[str, Any] = {}
        for name, item in found.items():
            mechanics = mechanics_document(item.told.parameters if item.told else (), item.units, drive)
            answers[name] = answer_document(item) | {"mechanics": mechanics}
        answers |= {name: {"verdict": "not_enough_data", "effect": None, "confidence": 1.0, "sentence": text} for name, text in refused.items()}
        emit({"axes": answers, "seconds": seconds, "notes": notes_of(recordings, names)})
        return
    for name, item in found.items():
        _show(name, item, drive)
    for text in (text for one in recordings for text in one.left_out(names)):
        say(text)
    say_refused(refused)


def _show(name: str, item: Answer, drive: Transmission) -> None:
    sure = "above 0.99" if item.confidence > 0.99 else f"{item.confidence:.2f}"
    say(f"axis {name}: {item.sentence.rstrip()} Confidence {sure}.")
    if item.where is not None and item.where.places:
        places = "; ".join(place.sentence for place in item.where.places[:3])
        say(f"  The rigid model fails: {places}.")
    if item.told and item.verdict != "nothing_missing":
        rows = []
        for one in sorted(item.candidates, key=lambda one: (float(f"{one.rung.held_out_error:.2g}"), one.name not in item.effects)):
            part = "-" if one.rung.one_step else f"{100 * one.explained:.3g} %"  # errors of one-step prediction are not comparable
            rows.append((*error_cells(f"{one.name} (refused)" if one.refused else one.name, one.rung), part))
        if rows:
            table(
                "each effect alone, smallest error first",
                ("effect", f"held-out error {motion(item.units.judged)[1]}", "times floor", "share of error"),
                rows,
            )
        parameter_table(item.told.parameters)
        mechanics_table(item.told.parameters, item.units, drive)
    say(f"  Next experiment: {item.next_experiment}\n")


def error_cells(name: str, rung: Rung) -> tuple[str, str, str]:
    """Name, held-out error, and its ratio to the noise floor; if free simulation cannot judge, the name says how it was judged."""
    label = f"{name} (error one sample ahead)" if rung.one_step else name
    return label, f"{motion(rung.units.judged)[0] * rung.held_out_error:.4g}", f"{rung.held_out_error / max(rung.noise_floor, 1e-300):.2f}"


def parameter_table(parameters: tuple[Estimate, ...]) -> None:
    """Print the parameters in display units."""
    rows = []
    for p in parameters:
        rows.append(estimate(p.name, (p.value, p.low, p.high), p.unit))
        rows += [estimate(f"  in recording {k}", (one.value, one.low, one.high), one.unit) for k, one in enumerate(p.recordings, 1)]
    table("", ("parameter", "value", "95 % interval", "unit"), rows)
