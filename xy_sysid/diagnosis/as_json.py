"""An answer and its parts in JSON's own types, as ``diagnose --json``, the story and model files have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from xy_sysid.comparison.where_it_fails import Place
from xy_sysid.diagnosis import words
from xy_sysid.diagnosis.answer import Answer, Rung, Tried
from xy_sysid.response.estimate import Estimate


def answer_document(found: Answer) -> dict[str, Any]:
    """One axis of the document that ``diagnose --json`` gives."""
    first, last = found.rungs[0] if found.rungs else None, found.told
    runner_up = words.runner_up(found)
    return {
        "verdict": found.verdict,
        "effect": found.effect,
        "effects": list(found.effects),
        "confidence": found.confidence,
        "tolerance": found.tolerance,
        "could_hide": found.could_hide,
        "sentence": found.sentence,
        "error": {
            "unit": found.units.judged,
            "now": first.held_out_error if first else None,
            "noise_floor": first.noise_floor if first else None,
            "held_out": last.held_out_error if last else None,
        },
        "where": [place(one) for one in found.where.places] if found.where is not None else [],
        "candidates": [_candidate(found, one) for one in found.candidates],
        "runner_up": {"effect": found.runner_up, "sentence": runner_up} if runner_up else None,
        "look_alikes": [asdict(one) for one in found.look_alikes],
        "next_experiment": found.next_experiment,
        "explained": found.explained,
        "noise": found.noise,
        "discrepancy": found.discrepancy,
        "unmodelled_force": _force(found),
        **stopped_and_refused(found),
    }


def _force(found: Answer) -> dict[str, Any] | None:
    """The force that nobody modelled, and its spectrum by bands, in the unit of the input."""
    if found.force is None:
        return None
    spectrum = [{"from": low, "to": high, "rms": rms} for low, high, rms in found.force.bands]
    return {"unit": found.units.input, "rms": found.force.rms, "input": found.force.input, "spectrum": spectrum}


def stopped_and_refused(found: Answer) -> dict[str, Any]:
    """What ended the search before it was done, and which sets explain nothing, and why."""
    refused = [{"effect": " and ".join(names), "reason": reason} for names, reason in found.refused]
    return {"stopped": "budget" if found.stopped else None, "refused": refused}


def _candidate(found: Answer, item: Tried) -> dict[str, Any]:
    before, rung = found.rungs[0].held_out_error, item.rung
    return {
        "effect": item.name,
        "held_out_error": rung.held_out_error,
        "error_ratio": rung.held_out_error / before if before > 0 else None,
        "excess": rung.excess,
        "share": item.explained,
        "parameters": parameters(rung.parameters),
        "evidence": words.evidence(found, item),
    }


def rung_document(item: Rung) -> dict[str, Any]:
    """One rung of the ladder."""
    return {
        "label": item.label,
        "added": item.added,
        "removed": item.removed,
        "effects": list(item.effects),
        "train_error": item.training_error,
        "held_out_error": item.held_out_error,
        "noise_floor": item.noise_floor,
        "excess": item.excess,
        "explained": item.explained,
        "parameters": parameters(item.parameters),
    }


def place(item: Place) -> dict[str, Any]:
    """One place where a model fails."""
    kept = asdict(item)
    return {"kind": kept.pop("kind"), "from": kept.pop("low"), "to": kept.pop("high"), **kept}


def parameters(items: tuple[Estimate, ...]) -> Mapping[str, Any]:
    """Every parameter with unit and 95 % interval; of what each recording has for itself the mean, and ``recordings``, one by one."""
    return {item.name: _parameter(item) for item in items}


def _parameter(item: Estimate) -> dict[str, Any]:
    own = {"recordings": [_parameter(one) for one in item.recordings]} if item.recordings else {}
    return {"value": float(item.value), "unit": item.unit, "ci95": [float(item.low), float(item.high)], **own}
