"""xy-sysid validate: a model on data that it has not seen."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import aside, emit, people, table
from xy_sysid.cli.reading import chosen, read


def validate(
    rec: o.Rec,
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model file written by fit --model")],
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    period: o.Period = "auto",
    span: o.Span = "",
    json: o.Json = False,
) -> None:
    """Check a model on a recording that it has not seen, in frequency and in time."""
    from xy_sysid.errors import BadInput
    from xy_sysid.exports import read_model
    from xy_sysid.model_check import check
    from xy_sysid.offline import estimate

    settings = o.settings_from(params, set_)
    models = read_model(model)
    recording = read(rec, axis, topic, effort, span, json)
    answers: dict[str, Any] = {}
    for name in chosen(recording, axis):
        if name not in models:
            raise BadInput(f"model of axis {name}", f"not in {model}", ", ".join(models), "Choose axes with --axis.")
        found = estimate(recording, name, settings, o.period_from(period))
        run = max(recording.runs(), key=lambda part: part.stop - part.start)
        u, y = recording.axis(name)
        answers[name] = check(models[name], found.frf, u[run], y[run], settings.hold)
        for note in found.notes:
            if not json:
                aside.print(f"axis {name}: {note}")
    if json:
        emit({"model": str(model), "recording": str(rec), "axes": answers})
        return
    rows = [
        (
            name,
            f"{100 * found.relative_error:.3g} %",
            f"{100 * found.noise_floor:.3g} %",
            f"{found.rms_sigma:.3g}",
            f"{found.worst_sigma:.3g} at {found.worst_hz:.4g} Hz",
            "-" if found.simulation is None else f"{found.simulation.nrmse:.1f} % of the {found.simulation.compared}",
        )
        for name, found in answers.items()
    ]
    table(f"{model} on {rec}", ("axis", "relative error", "of noise", "rms sigma", "worst sigma", "explained in time"), rows)
    for name, found in answers.items():
        people.print(f"axis {name}: {found.sentence}")
