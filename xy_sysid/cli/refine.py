"""xy-sysid refine: add effects, refit, watch the error fall."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own, error_cells, parameter_table, samples
from xy_sysid.cli.output import emit, people, progress, table
from xy_sysid.cli.provenance import provenance
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.ladder import Ladder
    from xy_sysid.open_loop import OpenLoop


PARTLY = 0.7  # of the excess, or of the held-out error, that may be left if effects are to count as a part of the truth


def refine(
    rec: o.Rec,
    add: Annotated[list[str] | None, typer.Option("--add", metavar="NAME", help="add this effect (may be repeated, in this order)")] = None,
    auto: Annotated[bool, typer.Option("--auto", help="go on by itself until the noise floor is reached or nothing helps")] = False,
    axis: o.Axes = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    span: o.Span = "",
    effect_file: Own = None,
    tolerance: Annotated[
        float, typer.Option(help="part of the signal that the model may leave; real machines need 0.01 or more", min=1e-6, max=0.5)
    ] = 1e-3,
    simulate_alone: Annotated[
        bool,
        typer.Option(
            "--open-loop", help="fit the named effects once more, to the whole record, for the best simulation of the position from the input alone"
        ),
    ] = False,
    model: Annotated[Path | None, typer.Option("--model", metavar="FILE", help="write the model with its physical parameters as YAML")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="write the linear part and all parameters for MATLAB")] = None,
    json: o.Json = False,
) -> None:
    """Add physical effects to the rigid model, refit everything together, and print the ladder of falling errors."""
    from xy_sysid.errors import BadInput
    from xy_sysid.greybox import prepare
    from xy_sysid.open_loop import open_loop, settled
    from xy_sysid.own_units import in_units
    from xy_sysid.refinement import refine as logic
    from xy_sysid.saved_models import write_axis_mat, write_axis_models
    from xy_sysid.user_effects import library

    if not add and not auto:
        raise BadInput("refine", "without --add and --auto", "--add NAME, or --auto", "Say what to do.")
    known = library(effect_file or [])
    for name in add or []:
        if known[name].category == "base":
            raise BadInput("--add", name, "an effect that is not in every model already", "See xy-sysid effects.")
    recording = read(rec, axis, topic, effort, span, json)
    names = chosen(recording, axis)
    alone: dict[str, OpenLoop] = {}
    with progress() as bar:
        task = bar.add_task("refining", total=len(names))

        def work(name: str) -> Ladder:
            bar.update(task, description=f"refining axis {name}")
            u, y = samples(recording, name)
            data = prepare(recording.sampling_rate, u, y, tolerance)
            found = logic(data, known, given=tuple(add or ()), most=len(add or ()) + 4 if auto else 0)
            if not found.final.model.ahead:  # free simulation says nothing about those
                found = replace(found, final=settled(data, found.final)) if simulate_alone else found
                alone[name] = open_loop(recording.sampling_rate, y, found.final.simulated)
            bar.advance(task)
            return found

        found, refused = each(names, work)
    origin = provenance(rec, recording)
    if model is not None:
        write_axis_models(model, {name: ladder.final for name, ladder in found.items()}, origin)
    if mat is not None:
        write_axis_mat(mat, {name: ladder.final for name, ladder in found.items()})
    units, unit = (recording.input_unit, recording.output_unit), f"{recording.output_unit}/s"
    if json:
        answers: dict[str, Any] = {
            name: in_units(_answer(ladder, unit) | _alone(alone.get(name), recording.output_unit), units) for name, ladder in found.items()
        }
        emit({"recording": origin, "axes": answers, "refused": refused})
        return
    for name, ladder in found.items():
        rows = [
            (label, f"{1e3 * step.fit.training_error:.4g}", held_out, over)
            for step in ladder.steps
            for label, held_out, over in [error_cells(step.added or "rigid, with delay", step.fit)]
        ]
        table(f"axis {name}: m{unit}, floor {1e3 * ladder.final.noise_floor:.4g}", ("added", "training error", "held-out error", "times floor"), rows)
        people.print(f"  {_words(ladder)}", markup=False)
        parameter_table(ladder.final, units)
        if name in alone:
            people.print(f"  {_alone_in_words(alone[name], recording.output_unit)}", markup=False)
        people.print()
    for name, text in refused.items():
        people.print(f"axis {name}: {text}", markup=False)


def verdict(ladder: Ladder) -> str:
    """The contract's word."""
    if ladder.explained:
        return "explained"
    first, last = ladder.steps[0].fit, ladder.final
    gone = last.excess < PARTLY * first.excess or last.held_out_error < PARTLY * first.held_out_error
    return "partly" if ladder.effects and gone else "not_in_library"


def _words(ladder: Ladder) -> str:
    names = ", ".join(ladder.effects) or "nothing"
    return {
        "explained": f"Explained by the base and {names}: the held-out error is at the noise floor.",
        "partly": f"{names} explain a part; the rest is not at the floor.",
        "not_in_library": "No effect of the library brings the error down.",
    }[verdict(ladder)]


def _alone_in_words(found: OpenLoop, unit: str) -> str:
    where = f"{1e3 * found.rms:.3g} m{unit} rms, {1e3 * found.worst:.3g} at worst ({100 * found.share:.2g} % of the measured spread)"
    return f"Open loop, the position of the whole record simulated from the input alone: off by {where}."


def _alone(found: OpenLoop | None, unit: str) -> dict[str, Any]:
    if found is None:
        return {"open_loop": None}
    return {"open_loop": {"rms": found.rms, "worst": found.worst, "share": found.share, "unit": unit}}


def _answer(ladder: Ladder, unit: str) -> dict[str, Any]:
    from xy_sysid.findings import parameters

    rungs = [
        {
            "added": step.added,
            "train_error": step.fit.training_error,
            "held_out_error": step.fit.held_out_error,
            "noise_floor": step.fit.noise_floor,
            "excess": step.fit.excess,
        }
        for step in ladder.steps
    ]
    return {
        "ladder": rungs,
        "unit": unit,
        "verdict": verdict(ladder),
        "effects": ladder.effects,
        "model": {"parameters": parameters(ladder.final.parameters)},
    }
