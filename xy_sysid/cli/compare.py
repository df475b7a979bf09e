"""xy-sysid compare: where does a model fail?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.checking import checked, longest
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, people, quantity, table
from xy_sysid.cli.provenance import fingerprint
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.comparison import Comparison
    from xy_sysid.distortion import Distortion
    from xy_sysid.model_check import ModelCheck
    from xy_sysid.paired import Paired
    from xy_sysid.recording import Recording
    from xy_sysid.saved_models import Saved

HELD_OUT = 1.0 / 3.0  # of the recording, when a model was fitted to it


Other = Annotated[
    Path | None, typer.Option(metavar="MODEL", help="compare two models in pairs on the same unseen data: the one before, and the one after")
]


def compare(
    rec: o.Rec,
    model: Annotated[
        Path | None,
        typer.Argument(
            metavar="[MODEL]", help="file of fit --model or refine --model; without one, a linear model is fitted to the first two thirds"
        ),
    ] = None,
    before: Other = None,
    after: Other = None,
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    span: o.Span = "",
    effect_file: Own = None,
    json: o.Json = False,
) -> None:
    """Where a model fails on data it has not seen: by frequency, speed, direction, position, amplitude and time; or which of two is better."""
    from xy_sysid.errors import BadInput
    from xy_sysid.saved_models import read_models
    from xy_sysid.user_effects import library

    if (before is None) != (after is None) or (model is not None and before is not None):
        raise BadInput("compare", "a mixture of models", "one MODEL, none, or --before MODEL --after MODEL", "Give one of these.")
    settings = o.settings_from(params, set_)
    known = library(effect_file or [])
    files = [path for path in (model, before, after) if path is not None]
    models = [read_models(path, known) for path in files]
    recording = read(rec, axis, topic, effort, span, json)
    names = chosen(recording, axis)
    for path, held in zip(files, models, strict=True):
        for name in names:
            if name not in held:
                raise BadInput(f"model of axis {name}", f"not in {path}", ", ".join(held), "Choose axes with --axis.")
    if before is not None:
        pairs, refused = each(names, lambda name: _pair(recording, name, models[0][name], models[1][name]))
        if json:
            emit({"before": str(before), "after": str(after), "axes": {name: _paired(item) for name, item in pairs.items()}, "refused": refused})
            return
        for name, pair in pairs.items():
            for held in models:
                if held[name].doubt:
                    aside.print(f"axis {name}: {held[name].doubt}")
            people.print(f"axis {name}: {pair.sentence}", markup=False)
        for name, text in refused.items():
            people.print(f"axis {name}: {text}", markup=False)
        return
    found: dict[str, Comparison] = {}
    lines: dict[str, ModelCheck | None] = {}
    splits: dict[str, Distortion | None] = {}
    for name in names:
        found[name], lines[name] = _compared(recording, name, models[0][name] if models else None, settings, quiet=json)
        splits[name] = _split(recording, name)
    if json:
        emit(
            {"model": None if model is None else str(model), "axes": {name: _answer(item, lines[name], splits[name]) for name, item in found.items()}}
        )
        return
    for name, item in found.items():
        people.print(f"axis {name}: {item.sentence}", markup=False)
        figures = [
            ("error", quantity(item.error, item.unit)),
            ("noise floor", quantity(item.noise_floor, item.unit)),
            ("up to", f"{item.band_end:.4g} Hz"),
        ]
        people.print("  " + ", ".join(f"{label} {text}" for label, text in figures))
        line, split = lines[name], splits[name]
        if line is not None:
            people.print(f"  {_in_frequency(line, item)}")
        if split is not None:
            people.print(f"  {split.sentence}")
        if item.places:
            rows = [(place.kind, f"{place.error_over_floor:.3g}", place.sentence) for place in item.places]
            table("", ("where", "over floor", "in words"), rows)


def _compared(recording: Recording, name: str, saved: Saved | None, settings: Any, quiet: bool) -> tuple[Comparison, ModelCheck | None]:
    """On the whole recording for a model of another one; else on its last third, with a model fitted to the rest if there is none."""
    from xy_sysid.comparison import compare_velocity
    from xy_sysid.errors import BadInput
    from xy_sysid.offline import estimate, fitted, split
    from xy_sysid.own_units import text_in, unit_in
    from xy_sysid.saved_models import Saved

    seen = saved is not None and saved.data == fingerprint(recording, name)
    training, unseen = split(recording, HELD_OUT if saved is None else 0.0)
    if saved is None:
        saved = Saved(fitted(estimate(training, name, settings).frf, settings).tf, None, "zoh", "")
        data = unseen
    else:
        data = recording
    if saved.doubt and not quiet:
        aside.print(f"axis {name}: {saved.doubt}")
    if seen and not quiet:
        aside.print(f"axis {name}: the model was fitted to this very recording; only its last third is looked at")
    u, y = longest(data, name)
    velocity = saved.velocity(data.sampling_rate, u, y)
    first = _held(len(y)) if seen else 0
    compared = compare_velocity(velocity[first:], u[first:], y[first:], data.sampling_rate, f"{data.output_unit}/s", data.output_unit)
    units = data.input_unit, data.output_unit
    places = (replace(place, sentence=text_in(place.sentence, units), unit=unit_in(place.unit, units)) for place in compared.places)
    compared = replace(compared, places=tuple(places))
    try:
        return compared, checked(data, name, saved, settings)[0]
    except BadInput:  # too short for a window, or nothing coherent: time alone must do
        return compared, None


def _in_frequency(line: ModelCheck, compared: Comparison) -> str:
    from xy_sysid.comparison import TWICE
    from xy_sysid.model_check import AT_THE_FLOOR

    text = f"in frequency: residual {line.rms_sigma:.3g} sigma rms, at worst {line.worst_sigma:.3g} at {line.worst_hz:.4g} Hz"
    hidden = line.rms_sigma <= AT_THE_FLOOR and compared.error > TWICE * compared.noise_floor
    return text + (": what fails does not repeat with the input, so a frequency response takes it for noise (friction does that)." if hidden else ".")


def _pair(recording: Recording, name: str, before: Saved, after: Saved) -> Paired:
    from xy_sysid.paired import paired

    u, y = longest(recording, name)
    first = _held(len(y)) if fingerprint(recording, name) in (before.data, after.data) else 0
    old, new = (saved.velocity(recording.sampling_rate, u, y)[first:] for saved in (before, after))
    return paired(old, new, y[first:], recording.sampling_rate)


def _held(samples: int) -> int:
    """The first sample that no fit to this recording has used."""
    return int((1.0 - HELD_OUT) * samples)


def _split(recording: Recording, name: str) -> Distortion | None:
    """Even and odd distortion of a recording with an odd multisine."""
    from xy_sysid.distortion import distortion
    from xy_sysid.period import find_period

    u, y = longest(recording, name)
    period = find_period(u)
    return distortion(recording.sampling_rate, u, y, period) if period else None


def _answer(item: Comparison, line: ModelCheck | None, split: Distortion | None) -> dict[str, Any]:
    return {
        "sentence": item.sentence,
        "error": {"unit": item.unit, "now": item.error, "noise_floor": item.noise_floor, "held_out": item.error},
        "where": [
            {"kind": p.kind, "from": p.low, "to": p.high, "unit": p.unit, "error_over_floor": p.error_over_floor, "sentence": p.sentence}
            for p in item.places
        ],
        "frequency": item.frequency,
        "error_over_floor": item.error_over_floor,
        "lines": None
        if line is None
        else {"sentence": _in_frequency(line, item), "frequency": line.frequency, "residual_sigma": line.sigmas, "rms_sigma": line.rms_sigma},
        "distortion": None if split is None else {"sentence": split.sentence, "period": split.period, "even": split.even, "odd": split.odd},
    }


def _paired(item: Paired) -> dict[str, Any]:
    changes = [{"from": one.low, "to": one.high, "ratio": one.ratio, "better": one.better} for one in item.changes]
    return {
        "sentence": item.sentence,
        "better": item.better,
        "error": {"unit": "m/s", "before": item.before, "after": item.after, "noise_floor": item.noise_floor},
        "ratio": {"value": item.ratio, "ci95": [item.low, item.high]},
        "t": item.t,
        "p": item.p,
        "windows": item.windows,
        "changes": changes,
    }
