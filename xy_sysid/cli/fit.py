"""xy-sysid fit: the parametric model, with its uncertainty and its verdicts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import aside, emit, estimates, people
from xy_sysid.cli.provenance import provenance
from xy_sysid.cli.reading import chosen, each, read

if TYPE_CHECKING:
    from xy_sysid.fitting import Fit, Structure
    from xy_sysid.offline import AxisEstimate
    from xy_sysid.recording import Recording
    from xy_sysid.validation import Validation


def fit(
    rec: o.Rec,
    axis: o.Axes = None,
    set_: o.Set = None,
    params: o.Params = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    period: o.Period = "auto",
    span: o.Span = "",
    method: Annotated[str, typer.Option(help="best (maximum likelihood), lls, iwls, nlls, ml, or nllsfdi (the paper's own path)")] = "best",
    weighting: Annotated[str, typer.Option(help="of a line's error: sigma, relative (1/|FRF|, the paper's) or uniform")] = "sigma",
    domain: Annotated[str, typer.Option(help="s (continuous) or z (discrete)")] = "s",
    held_out: Annotated[float, typer.Option(help="last part of the recording that no fit sees, for the check in time")] = 0.2,
    model: Annotated[Path | None, typer.Option("--model", metavar="FILE", help="write the model as YAML")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="write the model for MATLAB's tf()")] = None,
    json: o.Json = False,
) -> None:
    """Transfer function with delay of each axis, 95 % intervals, and whether it can be trusted."""
    import numpy as np

    from xy_sysid import exports
    from xy_sysid.errors import BadInput
    from xy_sysid.offline import estimate, judged, split
    from xy_sysid.validation import validate

    settings = o.settings_from(params, set_)
    for option, file in (("--model", model), ("--mat", mat)):
        o.output_file(option, file)
    samples = o.period_from(period)
    structure = _structure(settings, weighting, domain)
    estimator = _estimator(method)
    recording = read(rec, axis, topic, effort, span, json)
    training, unseen = split(recording, held_out)

    def work(name: str) -> tuple[AxisEstimate, Fit, Validation]:
        found = estimate(training, name, settings, samples)
        judged(found.frf)
        try:
            with np.errstate(all="ignore"):  # what overflows ends in a figure that the verdicts judge
                result = estimator(found.frf, structure)
                return found, result, validate(result, found.frf, _unseen(unseen, name))
        except (np.linalg.LinAlgError, ZeroDivisionError):
            raise BadInput("fit", "beyond what numbers can hold", "orders that the data determine", "Lower them or widen the band.") from None

    done, problems = each(chosen(recording, axis), work)
    fits = {name: result for name, (_, result, _) in done.items()}
    origin = provenance(rec, recording)
    if model is not None:
        exports.write_model(model, fits, origin)
    if mat is not None:
        exports.write_mat(mat, fits)
    if json:
        answers = {name: answer(*parts) for name, parts in done.items()} | {name: {"problem": text} for name, text in problems.items()}
        emit({"recording": origin, "axes": answers})
        return
    for parts in done.values():
        _show(*parts)
    for name, text in problems.items():
        people.print(f"axis {name}: no model. {text}")


def _structure(settings: Any, weighting: str, domain: str) -> Structure:
    from dataclasses import replace
    from typing import get_args

    from xy_sysid.errors import BadInput
    from xy_sysid.fitting.structure import Weighting
    from xy_sysid.live_fit import structure_from

    values: dict[str, Any] = {"weighting": weighting, "domain": domain}
    for name, allowed in (("weighting", get_args(Weighting)), ("domain", ("s", "z"))):
        if values[name] not in allowed:
            raise BadInput(f"--{name}", repr(values[name]), ", ".join(allowed), "Choose one of these.")
    return replace(structure_from(settings), **values)


def _estimator(method: str) -> Any:
    from xy_sysid.errors import BadInput
    from xy_sysid.fitting import ESTIMATORS, identify

    known = {"best": identify, **ESTIMATORS}
    if method not in known:
        raise BadInput("--method", repr(method), ", ".join(known), "Choose one of these.")
    return known[method]


def _unseen(recording: Recording, axis: str) -> Any:
    """(input, output, sampling rate) of the longest gap-free run that no fit saw, or None."""
    runs = recording.runs()
    if not runs:
        return None
    run = max(runs, key=lambda part: part.stop - part.start)
    u, y = recording.axis(axis)
    return u[run], y[run], recording.sampling_rate


def answer(found: AxisEstimate, result: Fit, verdicts: Validation) -> dict[str, Any]:
    """One axis of the JSON document."""
    tf = result.tf
    return {
        "method": result.method,
        "converged": result.converged,
        "reason": result.reason,
        "iterations": result.iterations,
        "transfer_function": {
            "numerator": tf.numerator,
            "denominator": tf.denominator,
            "delay": tf.delay,
            "sampling_time": tf.sampling_time,
            "input_unit": tf.input_unit,
            "output_unit": tf.output_unit,
        },
        "poles": result.poles,
        "zeros": result.zeros,
        "estimates": {item.name: {"value": item.value, "ci95": [item.low, item.high], "unit": item.unit} for item in result.intervals},
        "relative_error": result.relative_error,
        "paper": {"error_cost": result.error_cost, "confidence": result.confidence},
        "cost": result.cost,
        "expected_cost": result.expected_cost,
        "consistent": result.consistent,
        "lines": len(result.frequency),
        "band": [result.frequency[0], result.frequency[-1]],
        "windows": found.windows,
        "period": found.period,
        "validation": verdicts,
        "warnings": [*found.notes, *result.warnings],
    }


def _show(found: AxisEstimate, result: Fit, verdicts: Validation) -> None:
    f = result.frequency
    people.print(
        f"axis {found.axis}: {result.method}, {len(f)} lines from {f[0]:.3g} to {f[-1]:.4g} Hz, {found.windows} windows; "
        f"relative error {100 * result.relative_error:.2g} % (paper: error cost {result.error_cost:.2f}, confidence {result.confidence:.2f})",
        style="bold",
    )
    if not result.converged:
        people.print(f"The fit did not converge: {result.reason}", style="bold")
    estimates("", result.intervals)
    for check in verdicts.verdicts:
        people.print(f"  {'ok  ' if check.ok else 'WARN'} {check.sentence}")
    for note in found.notes:  # the warnings of the fit are among the verdicts
        aside.print(f"axis {found.axis}: {note}")
    people.print()
