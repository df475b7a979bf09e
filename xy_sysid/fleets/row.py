"""One axis of a recording -> its row of the fleet's table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.diagnosis.answer import Answer, Rung
from xy_sysid.diagnosis.of_run import diagnose, refined, runs_together
from xy_sysid.diagnosis.refine import Effort, never
from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit
from xy_sysid.fitting.choose_orders import choose
from xy_sysid.fitting.of_recording import judged
from xy_sysid.fitting.of_run import fit_response, frf
from xy_sysid.fitting.structure import structure_from
from xy_sysid.fitting.verdicts import Validation, validate
from xy_sysid.fleets.columns import ROOTS, column_of
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.moves import several_moves
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import IdentifierSettings
from xy_sysid.story.attempt import Attempt
from xy_sysid.units import derivative_of

Row = dict[str, Any]
FAULT = "This is a fault of xy_sysid; please report it."
FirstSets = tuple[tuple[str, tuple[str, ...]], ...]  # axes, and the effects to try first in each


@dataclass(frozen=True, slots=True)
class Plan:
    """How an axis is analysed.

    follow:  effects whose parameters are estimated in every recording, named or not, together with the named ones
    first:   by axis, effects that are tried before all others, from an earlier recording
    library: the known effects; clock: processor time, s
    """

    follow: tuple[str, ...] = ()
    first: FirstSets = ()
    library: Library = STANDARD
    clock: Callable[[], float] = never


def row_of(recording: Recording, axis: str, plan: Plan) -> Row:
    """The results of fit and diagnosis by column name; ``problem`` gives the reason for a missing one.

    An unforeseen error is also reported as a problem, so that the other axes of a file keep their rows. The search is limited by a count of
    work, not by time, so that the same samples give the same numbers on a busy machine. Columns without a value are left out.

    Raises BadInput for an axis that the recording does not have.
    """
    row: Row = {"axis": axis, "input_unit": recording.input_unit, "output_unit": recording.output_unit}
    row |= {"samples": len(recording), "gaps": max(len(recording.runs()) - 1, 0), "sampling_rate": recording.sampling_rate}
    row |= {"notes": " ".join(recording.notes) or None}
    run = recording.run(axis)
    row["data_sha256"] = run.digest
    problems: list[tuple[str, str]] = []
    for stage, work in (("fit", _linear), ("diagnosis", _diagnosis)):
        begun = plan.clock()
        with Attempt() as attempt:
            row |= work(recording, run, plan)
        if attempt.problem:
            problems.append((stage, f"{attempt.detail}. {FAULT}" if attempt.detail else attempt.problem))
        row[f"seconds_{stage}"] = plan.clock() - begun
    if problems:
        row["stage"] = ", ".join(stage for stage, _ in problems)
        row["problem"] = " ".join(dict.fromkeys(text for _, text in problems))
    return row


def _linear(_recording: Recording, run: Run, _plan: Plan) -> Row:
    response = frf(run)
    found, checks = _fitted(response)
    return _of_response(response) | _of_transfer_function(found) | {"tf_trustworthy": checks.trustworthy}


def _fitted(response: FrequencyResponse) -> tuple[Fit, Validation]:
    """A transfer function of the lowest order that explains the data up to noise; higher orders only if needed, as in the live nodes."""
    settings = IdentifierSettings()
    if derivative_of(response.output_unit) == 2:  # which of the three families applies must be found, too
        return fit_response(response, settings)
    judged(response)
    try:
        with np.errstate(all="ignore"):  # an overflow gives a number that the verdicts judge
            choice = choose(response, structure_from(settings), thorough=False)
            return choice.fit, validate(choice.fit, response, choice=choice)
    except (np.linalg.LinAlgError, ZeroDivisionError):
        raise BadInput("fit", "beyond what numbers can hold", "orders that the data determine", "Record for longer.") from None


def _of_response(response: FrequencyResponse) -> Row:
    lines = response.frequency[response.trusted]
    return {
        "frf_averages": response.averages,
        "frf_low": float(lines[0]) if lines.size else None,
        "frf_high": float(lines[-1]) if lines.size else None,
        "frf_trusted": float(np.mean(response.trusted)),
        "frf_coherence": float(np.median(response.coherence)),
    }


def _of_transfer_function(found: Fit) -> Row:
    row: Row = {
        "tf_numerator": _polynomial(found.tf.numerator.tolist()),
        "tf_denominator": _polynomial(found.tf.denominator.tolist()),
        "tf_relative_error": found.relative_error,
        "tf_misfit": _number(found.misfit),
    }
    real = [item for item in found.intervals_with_misfit if item.name.startswith("pole_") and "." not in item.name]
    slowest = min(real, key=lambda item: abs(item.value), default=None)
    wanted = {
        f"{kind}_{number}.{what}" for kind in ("resonance", "antiresonance") for number in range(1, ROOTS + 1) for what in ("frequency", "damping")
    }
    for item in found.intervals_with_misfit:
        if item.name in wanted | {"gain", "delay"}:
            row |= _interval(f"tf_{column_of(item.name)}", item.value, item.low, item.high)
        elif item is slowest:
            row |= _interval("tf_pole", item.value, item.low, item.high)
    return row


def _diagnosis(recording: Recording, run: Run, plan: Plan) -> Row:
    runs = runs_together(recording.stretches(run.axis))
    several_moves(runs)
    found = diagnose(runs, plan.library, first=dict(plan.first).get(run.axis, ()))
    row: Row = {
        "verdict": found.verdict,
        "effects": _listed(found.effects),
        "confidence": found.confidence,
        "sentence": found.sentence,
        "explained": found.explained,
        "noise": found.noise,
        "discrepancy": found.discrepancy,
    }
    named = found.told
    if named is None:  # not enough data
        return row | {"noise": None, "discrepancy": None, "explained": None}
    row |= _of_rung(named) | {"rigid_error": found.rungs[0].held_out_error, "tried_first": _listed(found.tried_first)}
    return row | _followed(runs, plan, found) if plan.follow else row


def _followed(runs: tuple[Run, ...], plan: Plan, found: Answer) -> Row:
    """Parameters of a fit with the named and the followed effects; empty if all of these are named."""
    more = tuple(name for name in plan.follow if name not in found.effects)
    return _of_rung(refined(runs, (*found.effects, *more), plan.library, Effort(0)).rungs[-1]) if more else {}


def _of_rung(rung: Rung) -> Row:
    row: Row = {
        "model": _listed(rung.effects),
        "held_out_error": rung.held_out_error,
        "noise_floor": rung.noise_floor,
        "one_step": rung.one_step,
    }
    for item in rung.parameters:
        row |= _interval(column_of(item.name), item.value, item.low, item.high)
    return row


def _interval(name: str, value: float, low: float, high: float) -> Row:
    return {name: float(value), f"{name}_low": _number(low), f"{name}_high": _number(high)}


def _number(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _polynomial(coefficients: list[float]) -> str:
    return " ".join(map(repr, coefficients))
