"""xy-sysid validate: a model on data that it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, people, table
from xy_sysid.cli.provenance import fingerprint
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.model_check import ModelCheck
    from xy_sysid.recording import Recording
    from xy_sysid.saved_models import Saved


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
    from xy_sysid.model_check import check, check_motion
    from xy_sysid.offline import estimate, judged
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
        found = estimate(recording, name, settings, samples)
        judged(found.frf)
        run = max(recording.runs(), key=lambda part: part.stop - part.start)
        u, y = recording.axis(name)
        saved = models[name]
        if saved.axis is None:
            return check(saved.tf, found.frf, u[run], y[run], saved.hold), found.notes
        moved = estimate(simulated(recording, name, saved), name, settings, samples)
        velocity = saved.velocity(recording.sampling_rate, u[run], y[run])
        return check_motion(velocity, moved.frf, found.frf, y[run]), found.notes

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


def simulated(recording: Recording, axis: str, saved: Saved) -> Recording:
    """The recording as the model says that this axis would have moved in it, run by run."""
    from dataclasses import replace

    import numpy as np

    u, y = recording.axis(axis)
    position = recording.position.copy()
    column = recording.axes.index(axis)
    for run in recording.runs():
        if run.stop - run.start > 1:
            moved = np.cumsum(saved.velocity(recording.sampling_rate, u[run], y[run])) / recording.sampling_rate
            position[run.start + 1 : run.stop, column] = y[run.start] + moved
    return replace(recording, position=position)
