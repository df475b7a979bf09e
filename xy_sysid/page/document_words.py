"""A story document in the words of the page. Pure functions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.report.story_words import confidence
from xy_sysid.report.words import quantity

Document = Mapping[str, Any]
SHOWN = 8  # candidates


@dataclass(frozen=True, slots=True)
class Row:
    """One candidate of the table."""

    effect: str
    evidence: str


def verdict_words(document: Document) -> str:
    """The result of the diagnosis of the rigid model, with its confidence."""
    return spaced(f"{document.get('sentence') or ''} {confidence(document)}").strip()


def model_effects(document: Document) -> list[str]:
    """Effects in the newest model, in the order of their addition."""
    ladder = document.get("ladder") or []
    return [str(name) for name in ladder[-1].get("effects", [])] if ladder else []


def candidate_rows(document: Document) -> list[Row]:
    """The tested candidates, best first, with their evidence."""
    return [Row(str(item["effect"]), spaced(str(item["evidence"]))) for item in (document.get("candidates") or [])[:SHOWN]]


def look_alike_lines(document: Document) -> list[str]:
    """Runner-up, look-alikes and the next experiment."""
    lines = []
    runner = document.get("runner_up")
    if runner:
        lines.append(f"Runner-up: {spaced(_named(str(runner['effect']), str(runner['sentence'])))}")
    for item in document.get("look_alikes") or []:
        state = "distinguished by these data" if item["told_apart"] else "not distinguished by these data"
        lines.append(spaced(f"Look-alike {item['effect']}, {state}: {item['sentence']}.".replace("..", ".")))
    if document.get("next_experiment"):
        lines.append(spaced(f"Next experiment: {document['next_experiment']}"))
    return lines


def ladder_words(document: Document) -> str:
    """The errors of all steps in words, for screen readers."""
    unit = str(document["error"]["unit"])
    rungs = [f"{str(rung['label']).replace('_', ' ')} {quantity(rung['held_out_error'], unit, 3)}" for rung in document.get("ladder") or []]
    floor = f"; noise floor {quantity(document['ladder'][-1]['noise_floor'], unit, 3)}" if rungs else ""
    return f"The error ladder of axis {document['axis']}, held-out: {', '.join(rungs) or 'no step yet'}{floor}."


def step_names(document: Document) -> dict[int, str]:
    """Steps that have figures: index -> name."""
    return {k: f"{k}: {str(step['label']).replace('_', ' ')}" for k, step in enumerate(document.get("steps") or []) if step.get("pictures")}


def _named(name: str, sentence: str) -> str:
    return sentence if name in sentence else f"{name}: {sentence}"


def spaced(sentence: str) -> str:
    """The text with names of effects written with spaces: coulomb friction."""
    return re.sub(r"(?<=[a-z])_(?=[a-z])", " ", sentence).replace("->", "→")
