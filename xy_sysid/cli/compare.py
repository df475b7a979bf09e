"""xy-sysid compare: where does a model fail?"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.output import aside, emit, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, read, reads
from xy_sysid.units import listed, moved, told

if TYPE_CHECKING:
    from xy_sysid.comparison.of_run import Judgement
    from xy_sysid.comparison.which_is_better import Paired
    from xy_sysid.imports.reading import Reading
    from xy_sysid.response.distortion import Distortion

Inputs = Annotated[
    list[Path],
    typer.Argument(
        metavar="REC [MODEL]",
        help="recordings, then a model file (.yaml) of fit or refine; without one, a linear model is fitted to the first two thirds",
    ),
]
Other = Annotated[Path | None, typer.Option(metavar="MODEL", help="compare two models on the same held-out data, before and after; give both")]


@reads
def compare(
    recs: Inputs,
    reading: Reading,
    before: Other = None,
    after: Other = None,
    set_: o.Set = None,
    params: o.Params = None,
    effect_file: Own = None,
    json: o.Json = False,
) -> None:
    """Show where a model fails on new data: by frequency, speed, direction, position, amplitude and time. Or show which of two models is better."""
    from xy_sysid.comparison.of_run import better, distorted, frequency_sentence, judge
    from xy_sysid.errors import BadInput
    from xy_sysid.files.effects import library
    from xy_sysid.files.models import read_models

    recs, model = _model_last(recs)
    if (before is None) != (after is None) or (model is not None and before is not None):
        raise BadInput("compare", "a mixture of models", "one MODEL, none, or --before MODEL --after MODEL", "Give one of these.")
    settings = o.settings_from(params, set_)
    known = library(effect_file or [])
    files = [path for path in (model, before, after) if path is not None]
    models = [read_models(path, known) for path in files]
    recording = read(recs, reading, json)
    names = chosen(recording, reading.axes)
    for path, held in zip(files, models, strict=True):
        for name in names:
            if name not in held:
                raise BadInput(f"model of axis {name}", f"not in {path}", ", ".join(held), "Choose axes with --axis.")
    if before is not None:
        pairs, refused = each(names, lambda name: better(recording.run(name), models[0][name], models[1][name]))
        if json:
            answers = {name: _paired(item) for name, item in pairs.items()}
            emit({"before": str(before), "after": str(after), "axes": answers, "refused": refused, "notes": recording.notes})
            return
        for name, pair in pairs.items():
            for held in models:
                if held[name].doubt:
                    say(f"axis {name}: {held[name].doubt}", aside)
            say(f"axis {name}: {pair.sentence}")
        say_refused(refused)
        return
    splits: dict[str, Distortion | None] = {}

    def judged_axis(name: str) -> Judgement:
        item = judge(recording, name, models[0][name] if models else None, settings)
        splits[name] = distorted(recording.run(name))
        return item

    found, refused = each(names, judged_axis)
    if json:
        emit(
            {
                "model": None if model is None else str(model),
                "notes": [*recording.notes, *(f"axis {name}: {note}" for name, item in found.items() for note in item.notes)],
                "axes": {name: _answer(item, splits[name]) for name, item in found.items()},
                "refused": refused,
            }
        )
        return
    notes: dict[str, list[str]] = {}
    for name, judged in found.items():
        for note in judged.notes:
            notes.setdefault(note, []).append(name)
    for note, axes in notes.items():
        say(f"{'axis' if len(axes) == 1 else 'axes'} {listed(axes)}: {note}", aside)
    for name, judged in found.items():
        item, line, split = judged.where, judged.check, splits[name]
        size = f"{moved(item.error, item.unit, 4)}, noise floor {moved(item.noise_floor, item.unit, 4)}, up to {item.band_end:.4g} Hz"
        times = item.error / max(item.noise_floor, 1e-300)
        fails = f"the error is {told(times)} times the noise floor ({size})." if item.places else f"{item.sentence} Error {size}."
        fails = fails if math.isfinite(item.error) else item.sentence
        say(f"axis {name}: {fails}")
        if line is not None:
            say(f"  {frequency_sentence(line, item)}")
        if split is not None:
            say(f"  {split.sentence}")
        if item.places:
            rows = [(place.kind, told(place.error_over_floor), place.sentence) for place in item.places]
            table("", ("where", "over floor", "in words"), rows)


def _model_last(given: list[Path]) -> tuple[list[Path], Path | None]:
    """The recordings, and the model: the last argument, if its ending is not that of a recording."""
    from xy_sysid.imports import TABLES

    *first, last = given
    is_model = bool(first) and last.suffix.lower() not in ("", ".db3", ".mcap", *TABLES) and not last.is_dir()
    return (first, last) if is_model else (given, None)


def _answer(judged: Judgement, split: Distortion | None) -> dict[str, Any]:
    from xy_sysid.comparison.of_run import frequency_sentence

    item, line = judged.where, judged.check
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
        else {"sentence": frequency_sentence(line, item), "frequency": line.frequency, "residual_sigma": line.sigmas, "rms_sigma": line.rms_sigma},
        "distortion": None if split is None else {"sentence": split.sentence, "period": split.period, "even": split.even, "odd": split.odd},
    }


def _paired(item: Paired) -> dict[str, Any]:
    changes = [{"from": one.low, "to": one.high, "ratio": one.ratio, "better": one.better} for one in item.changes]
    return {
        "sentence": item.sentence,
        "better": item.better,
        "error": {"unit": item.unit, "before": item.before, "after": item.after, "noise_floor": item.noise_floor},
        "ratio": {"value": item.ratio, "ci95": [item.low, item.high]},
        "t": item.t,
        "p": item.p,
        "windows": item.windows,
        "changes": changes,
    }
