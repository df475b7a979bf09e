"""xy-sysid compare: where does a model fail?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, people, quantity, table
from xy_sysid.cli.reading import chosen, read

if TYPE_CHECKING:
    from xy_sysid.comparison import Comparison

HELD_OUT = 1.0 / 3.0  # of the recording, when the model has to be fitted first


def compare(
    rec: o.Rec,
    model: Annotated[
        Path | None, typer.Argument(metavar="[MODEL]", help="model file; without one, a linear model is fitted to the first two thirds")
    ] = None,
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    span: o.Span = "",
    json: o.Json = False,
) -> None:
    """Where the model fails, on data it has not seen: by frequency, speed, direction, position, amplitude and time."""
    from xy_sysid.comparison import compare as logic
    from xy_sysid.errors import BadInput
    from xy_sysid.exports import read_model
    from xy_sysid.fitting import identify
    from xy_sysid.live_fit import structure_from
    from xy_sysid.offline import estimate, split

    settings = o.settings_from(params, set_)
    models = read_model(model) if model is not None else {}
    recording = read(rec, axis, topic, effort, span, json)
    training, unseen = split(recording, 0.0 if model is not None else HELD_OUT)
    data = training if model is not None else unseen
    found: dict[str, Comparison] = {}
    for name in chosen(recording, axis):
        if model is not None and name not in models:
            raise BadInput(f"model of axis {name}", f"not in {model}", ", ".join(models), "Choose axes with --axis.")
        tf = models[name] if model is not None else identify(estimate(training, name, settings).frf, structure_from(settings)).tf
        run = max(data.runs(), key=lambda part: part.stop - part.start)
        u, y = data.axis(name)
        found[name] = logic(tf, u[run], y[run], data.sampling_rate)
    if json:
        emit({"model": None if model is None else str(model), "axes": {name: _answer(item) for name, item in found.items()}})
        return
    for name, item in found.items():
        people.print(f"axis {name}: {item.sentence}", markup=False)
        figures = [
            ("error", quantity(item.error, item.unit)),
            ("noise floor", quantity(item.noise_floor, item.unit)),
            ("up to", f"{item.band_end:.4g} Hz"),
        ]
        people.print("  " + ", ".join(f"{label} {text}" for label, text in figures))
        if item.places:
            rows = [(place.kind, f"{place.error_over_floor:.3g}", place.sentence) for place in item.places]
            table("", ("where", "over floor", "in words"), rows)


def _answer(item: Comparison) -> dict[str, Any]:
    return {
        "sentence": item.sentence,
        "error": {"unit": item.unit, "now": item.error, "noise_floor": item.noise_floor, "held_out": item.error},
        "where": [
            {"kind": p.kind, "from": p.low, "to": p.high, "unit": p.unit, "error_over_floor": p.error_over_floor, "sentence": p.sentence}
            for p in item.places
        ],
        "frequency": item.frequency,
        "error_over_floor": item.error_over_floor,
    }
