"""xy-sysid refine: add effects, refit, and print the falling error."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own, error_cells, parameter_table
from xy_sysid.cli.mechanics import Gear, Kt, mechanics_document, mechanics_table
from xy_sysid.cli.output import emit, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, named, notes_of, read_each, reads, runs_of
from xy_sysid.files.provenance import provenance
from xy_sysid.units import bare, motion, moved

if TYPE_CHECKING:
    from xy_sysid.diagnosis.answer import Answer
    from xy_sysid.greybox.open_loop import OpenLoop
    from xy_sysid.imports.reading import Reading


@reads
def refine(
    recs: o.Recs,
    reading: Reading,
    add: Annotated[list[str] | None, typer.Option("--add", metavar="NAME", help="add this effect (may be repeated, in this order)")] = None,
    auto: Annotated[bool, typer.Option("--auto", help="add effects until the noise floor is reached or no effect helps")] = False,
    effect_file: Own = None,
    tolerance: Annotated[
        float, typer.Option(help="part of the signal that is treated as noise; real machines need 0.01 or more", min=1e-6, max=0.5)
    ] = 1e-3,
    simulate_alone: Annotated[
        bool,
        typer.Option("--open-loop", help="also fit the effects to the position of the whole record; best for a simulation from the input alone"),
    ] = False,
    model: Annotated[Path | None, typer.Option("--model", metavar="FILE", help="write the model with its physical parameters as YAML")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="write the linear part and all parameters for MATLAB")] = None,
    force: o.Force = False,
    kt: Kt = None,
    gear: Gear = "",
    budget: o.Budget = None,
    json: o.Json = False,
) -> None:
    """Add physical effects to the rigid model, fit all parameters again after each, and print the falling error."""
    from xy_sysid.axis.mechanics import drive_from
    from xy_sysid.diagnosis.answer import Rung
    from xy_sysid.diagnosis.of_run import refined
    from xy_sysid.diagnosis.refine import Effort
    from xy_sysid.diagnosis.words import of_one_stretch
    from xy_sysid.errors import BadInput
    from xy_sysid.files.effects import library
    from xy_sysid.files.models import write_axis_mat, write_axis_models
    from xy_sysid.greybox.axis_data import prepare
    from xy_sysid.greybox.open_loop import open_loop, settled
    from xy_sysid.hypotheses.criteria import MOST_EFFECTS

    if not add and not auto:
        raise BadInput("refine", "without --add and --auto", "--add NAME, or --auto", "Say what to do.")
    known = library(effect_file or [])
    for name in add or []:
        if known[name].category == "base":
            raise BadInput("--add", name, "an effect that is not part of every model", "See xy-sysid effects.")
    o.output_file("--model", model, force)
    o.output_file("--mat", mat, force)
    recordings = read_each(recs, reading, json)
    recording = recordings[0]
    names = chosen(recording, reading.axes)
    drive = drive_from(kt, gear, recording.units)
    alone: dict[str, OpenLoop] = {}

    def work(name: str) -> Answer:
        runs = runs_of(recordings, name)
        run, effort = runs[0], Effort(MOST_EFFECTS if auto else 0, math.inf if budget is None else budget, time.process_time)
        found = refined(runs, tuple(add or ()), known, effort, tolerance)
        if not found.final.one_step and len(runs) == 1:  # free simulation cannot judge the others
            if simulate_alone:
                data = prepare(run.sampling_rate, run.voltage, run.position, tolerance, run.units)
                found = replace(found, settled=Rung.of(settled(data, found.final)))
            alone[name] = open_loop(run.sampling_rate, run.position, found.final.simulated, found.final.model.pole)
        return found

    found, refused = each(names, work, "refining ")
    origin = provenance(named(recs), recording)
    if model is not None:
        write_axis_models(model, {name: item.final for name, item in found.items()}, origin)
    if mat is not None:
        write_axis_mat(mat, {name: item.final for name, item in found.items()})
    alone_notes = [f"axis {name}:{said}" for name, item in found.items() if (said := of_one_stretch(item, item.runs[0].seconds))]
    if json:
        answers: dict[str, Any] = {
            name: _answer(item)
            | _alone(alone.get(name), recording.output_unit)
            | {"mechanics": mechanics_document(item.final.parameters, recording.units, drive)}
            for name, item in found.items()
        }
        emit({"recording": origin, "axes": answers, "refused": refused, "notes": [*notes_of(recordings, names), *alone_notes]})
        return
    scale, unit = motion(recording.units.judged)
    for name, item in found.items():
        rows = []
        for rung in item:
            label, held_out, over = error_cells(rung.added or "rigid, with delay", rung)
            rows.append((label, f"{scale * rung.training_error:.4g}", held_out, over))
        floor = scale * item.final.noise_floor
        table(f"axis {name}: {unit}, floor {floor:.4g}", ("added", "training error", "held-out error", "times floor"), rows)
        say(f"  {_words(item)}")
        parameter_table(item.final.parameters)
        mechanics_table(item.final.parameters, recording.units, drive)
        if name in alone:
            say(f"  {_alone_in_words(alone[name], recording.output_unit)}")
        say()
    for text in (*(text for one in recordings for text in one.left_out(names)), *alone_notes):
        say(text)
    say_refused(refused)


def verdict(found: Answer) -> str:
    """The verdict in the JSON document: explained, partly, or not_in_library."""
    from xy_sysid.hypotheses.criteria import AT_FLOOR
    from xy_sysid.story.standing import nearer

    if found.final.excess < AT_FLOOR:
        return "explained"
    first, last = ((fit.excess, fit.held_out_error) for fit in (found.base, found.final))
    return "partly" if found.effects and nearer(first, last) else "not_in_library"


def _words(found: Answer) -> str:
    names, word = ", ".join(found.effects) or "nothing", verdict(found)
    if word == "explained":
        said = f"Explained by the rigid model and {names}: the held-out error is at the noise floor."
    elif found.effects:
        explain = f"{'explain' if len(found.effects) > 1 else 'explains'}{'' if word == 'partly' else ' only'}"
        said = f"{names} {explain} {100 * found.explained:.3g} % of the error's power; "
        said += f"the residual error beyond the noise is {moved(found.discrepancy, found.units.judged)}."
    else:
        said = "No effect of the library reduces the error."
    return f"{said} The search was stopped at its time limit." if found.stopped else said


def _alone_in_words(found: OpenLoop, unit: str) -> str:
    where = f"{moved(found.rms, unit)} rms, {bare(found.worst, unit)} at worst ({100 * found.share:.2g} % of the measured spread)"
    return f"Open loop (position of the whole record, simulated from the input alone): error {where}."


def _alone(found: OpenLoop | None, unit: str) -> dict[str, Any]:
    if found is None:
        return {"open_loop": None}
    return {"open_loop": {"rms": found.rms, "worst": found.worst, "share": found.share, "unit": unit}}


def _answer(found: Answer) -> dict[str, Any]:
    from xy_sysid.diagnosis.as_json import parameters, rung_document, stopped_and_refused

    keys = ("added", "train_error", "held_out_error", "noise_floor", "excess")
    return {
        "ladder": [{key: document[key] for key in keys} for document in map(rung_document, found)],
        "unit": found.units.judged,
        "verdict": verdict(found),
        "effects": found.effects,
        "explained": found.explained,
        "noise": found.noise,
        "discrepancy": found.discrepancy,
        **stopped_and_refused(found),
        "model": {"parameters": parameters(found.final.parameters)},
    }
