"""xy-sysid diagnose: which physical effect is missing?"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, people, progress, table
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.diagnosis import Diagnosis
    from xy_sysid.greybox import GreyboxFit
    from xy_sysid.recording import Recording

Own = Annotated[list[Path] | None, typer.Option("--effect-file", metavar="FILE", help="a Python file with an effect of your own (may be repeated)")]


def diagnose(
    rec: o.Rec,
    axis: o.Axes = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    span: o.Span = "",
    effect_file: Own = None,
    json: o.Json = False,
) -> None:
    """Name the physical effect that the rigid model of each axis misses, with evidence, or say that none is known."""
    from xy_sysid.diagnosis import diagnose as logic
    from xy_sysid.findings import answer, findings
    from xy_sysid.user_effects import library

    begun = time.perf_counter()
    known = library(effect_file or [])
    recording = read(rec, axis, topic, effort, span, json)
    names = chosen(recording, axis)
    with progress() as bar:
        task = bar.add_task("diagnosing", total=len(names))

        def work(name: str) -> Diagnosis:
            bar.update(task, description=f"diagnosing axis {name}")
            u, y = samples(recording, name)
            found = logic(recording.sampling_rate, u, y, known)
            bar.advance(task)
            return found

        found, refused = each(names, work)
    seconds = time.perf_counter() - begun
    units = recording.input_unit, recording.output_unit
    if json:
        answers: dict[str, Any] = {name: answer(findings(item, known), units) for name, item in found.items()}
        answers |= {name: {"verdict": "not_enough_data", "effect": None, "confidence": 1.0, "sentence": text} for name, text in refused.items()}
        emit({"axes": answers, "seconds": seconds})
        return
    for name, item in found.items():
        _show(name, item, units)
    for name, text in refused.items():
        people.print(f"axis {name}: {text}", markup=False)


def samples(recording: Recording, axis: str) -> Any:
    """Input and output of the longest gap-free run."""
    run = max(recording.runs(), key=lambda part: part.stop - part.start)
    u, y = recording.axis(axis)
    return u[run], y[run]


def _show(name: str, item: Diagnosis, units: tuple[str, str]) -> None:
    from xy_sysid.own_units import text_in

    people.print(f"axis {name}: {text_in(item.sentence, units)} (confidence {item.confidence:.2f})", markup=False)
    if item.where is not None and item.where.places:
        places = "; ".join(place.sentence for place in item.where.places[:3])
        people.print(f"  the rigid model fails: {text_in(places, units)}", markup=False)
    if item.ladder is not None and item.verdict != "nothing_missing":
        rows = [(*error_cells(c.effect, c.fit), f"{100 * c.share:.2g} %") for c in item.candidates if c.fit is not None]
        if rows:
            table("candidates", ("effect", f"held-out error m{units[1]}/s", "times floor", "share of error"), rows)
        parameter_table(item.ladder.final, units)
    people.print(f"  Next experiment: {item.next_experiment}\n", markup=False)


def error_cells(name: str, fit: GreyboxFit) -> tuple[str, str, str]:
    """Name, held-out error and what that is over the noise floor; where free simulation cannot judge, the name says what was judged."""
    label = f"{name} (error one sample ahead)" if fit.model.ahead else name
    return label, f"{1e3 * fit.held_out_error:.4g}", f"{fit.held_out_error / max(fit.noise_floor, 1e-300):.2f}"


def parameter_table(fit: GreyboxFit, units: tuple[str, str]) -> None:
    """Parameters of a fit, as people read them; units: of the recording's input and output."""
    from xy_sysid.own_units import unit_in

    rows = [(p.name, f"{p.value:.5g}", _interval(p.low, p.high), unit_in(p.unit, units)) for p in fit.parameters]
    table("", ("parameter", "value", "95 % interval", "unit"), rows)


def _interval(low: float, high: float) -> str:
    return f"{low:.5g} .. {high:.5g}" if math.isfinite(low) or math.isfinite(high) else "-"
