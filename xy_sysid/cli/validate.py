"""xy-sysid validate: a model on new data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, plain, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, read, reads
from xy_sysid.units import moved, told

if TYPE_CHECKING:
    from xy_sysid.fitting.check_on_data import ModelCheck
    from xy_sysid.imports.reading import Reading
    from xy_sysid.linear.any_model import AnyModel
    from xy_sysid.samples.recording import Recording

DOES_NOT_HOLD = 1  # exit code


@reads
def validate(
    rec: o.Rec,
    reading: Reading,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model file written by fit --model or refine --model")],
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    effect_file: Own = None,
    json: o.Json = False,
) -> None:
    """Check a model on a recording that it was not fitted to, in frequency and in time; exit code 1 if it fails on an axis."""
    from xy_sysid.comparison.of_run import in_frequency
    from xy_sysid.errors import BadInput
    from xy_sysid.files.effects import library
    from xy_sysid.files.models import read_models
    from xy_sysid.fitting.verdicts import simulation_sentence

    settings = o.settings_from(params, set_)
    samples = o.period_from(period)
    models = read_models(model, library(effect_file or []))
    recording = read([rec], reading, json)

    def work(name: str) -> tuple[ModelCheck, tuple[str, ...]]:
        if name not in models:
            raise BadInput(f"model of axis {name}", f"not in {model}", ", ".join(models), "Choose axes with --axis.")
        return in_frequency(recording, name, models[name], settings, samples)

    done, problems = each(chosen(recording, reading.axes), work)
    answers = {name: found for name, (found, _) in done.items()}
    holds = not problems and all(found.holds for found in answers.values())
    same = [name for name in answers if recording.run(name).digest in models[name].data]
    alone = {name: _alone(recording, name, models[name]) for name in answers}
    if json:
        emit(
            {
                "model": str(model),
                "recording": str(rec),
                "notes": recording.notes,
                "same_data_as_the_fit": same,
                "axes": {name: plain(found) | alone[name] for name, found in answers.items()}
                | {name: {"problem": text} for name, text in problems.items()},
            }
        )
        raise typer.Exit(0 if holds else DOES_NOT_HOLD)
    rows = [
        (
            name,
            told(100 * found.relative_error),
            told(100 * found.noise_floor),
            told(found.rms_sigma),
            told(found.worst_sigma),
            f"{found.worst_hz:.4g}",
            "-" if found.simulation is None else f"{found.simulation.nrmse:.1f}",
        )
        for name, found in answers.items()
    ]
    table(f"{model} on {rec}", ("axis", "error %", "noise %", "rms sigma", "worst sigma", "at Hz", "in time %"), rows)
    for name, (_, notes) in done.items():
        for note in notes:
            say(f"axis {name}: {note}", aside)
    for name in same:
        say(f"axis {name}: the model was fitted to this recording, so this is not a validation", aside)
    for name, found in answers.items():
        say(f"axis {name}: {found.sentence}")
        if found.simulation is not None:
            say(f"axis {name}: {simulation_sentence(found.simulation)}")
        if alone[name]:
            off = moved(alone[name]["position_rmse"], recording.output_unit)
            say(
                f"axis {name}: simulated from the input alone, the position of the whole record has an error of {off} rms; "
                f"{100 * alone[name]['explained']:.3g} % of the power of the motion is explained."
            )
    say_refused(problems, "not checked. ")
    raise typer.Exit(0 if holds else DOES_NOT_HOLD)


def _alone(recording: Recording, axis: str, model: AnyModel) -> dict[str, float]:
    """For a model with physical effects: rms error of the position simulated from the input alone, and the explained fraction of the motion."""
    from xy_sysid.comparison.physical_model import PhysicalModel
    from xy_sysid.greybox.open_loop import from_input_alone

    if not isinstance(model, PhysicalModel):
        return {}
    run = recording.run(axis)
    simulated = model.velocity(run.sampling_rate, run.voltage, run.position)
    rms, explained = from_input_alone(run.sampling_rate, run.position, simulated, model.model.pole)
    return {"position_rmse": rms, "explained": explained}
