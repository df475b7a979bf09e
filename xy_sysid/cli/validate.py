"""xy-sysid validate: a model on data that it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.checking import checked
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, people, table
from xy_sysid.cli.provenance import fingerprint
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.model_check import ModelCheck


def validate(
    rec: o.Rec,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model file written by fit --model or refine --model")],
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
    """Check a model on a recording that it has not seen, in frequency and in time."""
    from xy_sysid.errors import BadInput
    from xy_sysid.saved_models import read_models
    from xy_sysid.user_effects import library
    from xy_sysid.validation import simulation_sentence

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    models = read_models(model, library(effect_file or []))
    recording = read(rec, axis, topic, effort, span, json)

    def work(name: str) -> tuple[ModelCheck, tuple[str, ...]]:
        if name not in models:
            raise BadInput(f"model of axis {name}", f"not in {model}", ", ".join(models), "Choose axes with --axis.")
        return checked(recording, name, models[name], settings, samples)

    done, problems = each(chosen(recording, axis), work)
    answers = {name: found for name, (found, _) in done.items()}
    same = [name for name in answers if models[name].data == fingerprint(recording, name)]
    if json:
        emit(
            {
                "model": str(model),
                "recording": str(rec),
                "same_data_as_the_fit": same,
                "axes": answers | {name: {"problem": text} for name, text in problems.items()},
            }
        )
        return
    rows = [
        (
            name,
            f"{100 * found.relative_error:.3g}",
            f"{100 * found.noise_floor:.3g}",
            f"{found.rms_sigma:.3g}",
            f"{found.worst_sigma:.3g}",
            f"{found.worst_hz:.4g}",
            "-" if found.simulation is None else f"{found.simulation.nrmse:.1f}",
        )
        for name, found in answers.items()
    ]
    table(f"{model} on {rec}", ("axis", "error %", "noise %", "rms sigma", "worst sigma", "at Hz", "in time %"), rows)
    for name, (_, notes) in done.items():
        for note in notes:
            aside.print(f"axis {name}: {note}")
    for name in same:
        aside.print(f"axis {name}: the model was fitted to this very recording, so this is no validation")
    for name, found in answers.items():
        people.print(f"axis {name}: {found.sentence}")
        if found.simulation is not None:
            people.print(f"axis {name}: {simulation_sentence(found.simulation)}")
    for name, text in problems.items():
        people.print(f"axis {name}: not checked. {text}")
