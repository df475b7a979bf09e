"""xy-sysid fit: the parametric model, with its uncertainty and its verdicts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.mechanics import Gear, Kt, mechanics_document, mechanics_table
from xy_sysid.cli.output import aside, emit, estimates, say, say_refused
from xy_sysid.cli.reading import chosen, each, measured_responses, named, read, reads
from xy_sysid.files.provenance import provenance, provenance_of_response

if TYPE_CHECKING:
    from xy_sysid.fitting import Fit
    from xy_sysid.fitting.of_recording import AxisEstimate
    from xy_sysid.fitting.of_run import Method
    from xy_sysid.fitting.verdicts import Validation
    from xy_sysid.imports.reading import Reading
    from xy_sysid.response.frf import FrequencyResponse
    from xy_sysid.settings import IdentifierSettings


@reads
def fit(
    recs: o.Recs,
    reading: Reading,
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    method: Annotated[str, typer.Option(help="best (maximum likelihood), lls, iwls, nlls, ml, or nllsfdi (the paper's method)")] = "best",
    weighting: Annotated[str, typer.Option(help="weight of each line: sigma, relative (1/|FRF|, as in the paper) or uniform")] = "sigma",
    domain: Annotated[str, typer.Option(help="s (continuous) or z (discrete)")] = "s",
    held_out: Annotated[float, typer.Option(help="last part of the recording, held out for the check in time")] = 0.2,
    model: Annotated[Path | None, typer.Option("--model", metavar="FILE", help="write the model as YAML")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="write the model for MATLAB's tf()")] = None,
    averages: Annotated[
        float | None, typer.Option("--averages", min=2.0, help="independent windows behind the coherence of a measured response")
    ] = None,
    kt: Kt = None,
    gear: Gear = "",
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Fit a transfer function with delay to each axis, with 95 % intervals and checks. REC may also be a measured frequency response."""
    from xy_sysid.axis.mechanics import drive_from
    from xy_sysid.errors import BadInput
    from xy_sysid.files import linear_models
    from xy_sysid.fitting.of_given_response import band_of
    from xy_sysid.fitting.of_recording import estimate, few_periods, split
    from xy_sysid.fitting.of_run import Method, fit_response
    from xy_sysid.units import units_of

    settings = o.settings_from(params, set_)
    o.output_file("--model", model, force)
    o.output_file("--mat", mat, force)
    samples = o.period_from(period)
    way = Method(method, weighting, domain)
    way.structure(settings)  # raises BadInput for invalid combinations, before any work
    measured = measured_responses(recs, reading, averages)
    if measured is not None:
        drives = {name: drive_from(kt, gear, units_of(one.input_unit, one.output_unit)) for name, one in measured.items()}
        done, problems = each(tuple(measured), lambda name: _of_response(name, band_of(measured[name], settings), settings, way))
        origin: dict[str, Any] = {**provenance_of_response(named(recs)), "notes": []}
    else:
        if averages is not None:
            raise BadInput(
                "--averages",
                f"{averages:g}",
                "a file with a measured frequency response",
                "Leave it out: the windows of a recording are counted automatically.",
            )
        recording = read(recs, reading, json)
        drives = dict.fromkeys(recording.axes, drive_from(kt, gear, recording.units))
        if len(recording) and few_periods(recording, held_out):
            held_out = 0.0
            aside.print("note: the recording has hardly more than two periods of the input, so nothing is held out for the check in time")
        training, unseen = split(recording, held_out)

        def work(name: str) -> tuple[AxisEstimate, Fit, Validation]:
            found = estimate(training, name, settings, samples)
            return found, *fit_response(found.frf, settings, way, unseen.run(name).sensed if len(unseen) else None)

        done, problems = each(chosen(recording, reading.axes), work)
        origin = provenance(named(recs), recording)
    fits = {name: result for name, (_, result, _) in done.items()}
    if model is not None:
        linear_models.write_model(model, fits, origin)
    if mat is not None:
        linear_models.write_mat(mat, fits)
    if json:
        answers: dict[str, Any] = {name: {"problem": text} for name, text in problems.items()}
        for name, parts in done.items():
            answers[name] = answer(*parts) | {"mechanics": mechanics_document(fits[name].rigid, fits[name].units, drives[name])}
        emit({"recording": origin, "axes": answers})
        return
    for name, parts in done.items():
        _show(*parts)
        mechanics_table(fits[name].rigid, fits[name].units, drives[name])
    say_refused(problems, "no model. ")


def _of_response(name: str, response: FrequencyResponse, settings: IdentifierSettings, way: Method) -> tuple[AxisEstimate, Fit, Validation]:
    """One axis of a file with a response and without samples."""
    from xy_sysid.fitting.of_given_response import settings_for
    from xy_sysid.fitting.of_recording import AxisEstimate
    from xy_sysid.fitting.of_run import fit_response

    taken = settings_for(response, settings)
    note = f"fitted with {taken.integrators} integrator{'s' * (taken.integrators != 1)} and hold={taken.hold} (change them with --set)"
    notes = (*response.origin.notes, note)
    return AxisEstimate(axis=name, frf=response, period=None, windows=0, notes=notes), *fit_response(response, settings, way)


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
        "estimates": {
            item.name: {"value": item.value, "ci95": [item.low, item.high], "unit": item.unit, "ci95_with_misfit": [wide.low, wide.high]}
            for item, wide in zip(result.intervals, result.intervals_with_misfit, strict=True)
        },
        "misfit": result.misfit,
        "trustworthy": verdicts.trustworthy,
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


def _error(result: Fit) -> str:
    if not result.error_cost < 1e6:
        return "the model explains none of the response"
    return f"relative error {result.error_cost:.2g} % (paper: error cost {result.error_cost:.2f}, confidence {result.confidence:.2f})"


def _show(found: AxisEstimate, result: Fit, verdicts: Validation) -> None:
    f = result.frequency
    source = f"{found.windows} windows" if found.windows else "measured elsewhere"
    say(f"axis {found.axis}: {result.method}, {len(f)} lines from {f[0]:.3g} to {f[-1]:.4g} Hz, {source}; {_error(result)}", style="bold")
    if not result.converged:
        say(f"The fit did not converge: {result.reason}", style="bold")
    estimates("", result.intervals_with_misfit)
    if result.misfit > 1.0:
        left = f"the intervals are {result.misfit:.3g} times those of noise alone, because of the residual error"
        say(f"  {left}." if verdicts.trustworthy else f"  NOT TRUSTWORTHY: {left}; take them as orders of magnitude.")
    for check in verdicts.verdicts:
        say(f"  {'ok  ' if check.ok else 'WARN'} {check.sentence}")
    for note in found.notes:  # warnings of the fit are in the verdicts
        say(f"axis {found.axis}: {note}", aside)
    say()
