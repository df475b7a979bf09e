"""A story document in the words of the page. Pure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.report.words import number, quantity

Document = Mapping[str, Any]
VERDICTS = {
    "missing_effect": "Something is missing",
    "nothing_missing": "Nothing is missing",
    "not_in_library": "Something is missing that is not in the library",
    "not_enough_data": "Not enough data",
}


@dataclass(frozen=True, slots=True)
class Row:
    """One candidate."""

    effect: str
    evidence: str


def verdict_words(document: Document) -> str:
    """The verdict, how sure it is, and where the newest model stands."""
    sentence = str(document.get("sentence") or "")
    if document.get("verdict"):
        sure = document.get("confidence")
        words = f"{VERDICTS.get(str(document['verdict']), str(document['verdict']))}"
        words += f" (confidence {100 * sure:.0f} %)" if isinstance(sure, (int, float)) else ""
        sentence = f"{words}. {sentence}"
    return spaced(f"{sentence} {standing(document)}").strip()


def standing(document: Document) -> str:
    """How far the newest model is from the floor."""
    ladder = document.get("ladder") or []
    if not ladder:
        return ""
    last, unit = ladder[-1], str(document["error"]["unit"])
    held, floor = last.get("held_out_error"), last.get("noise_floor")
    if held is None or not floor:
        return ""
    if last.get("explained"):
        return f"The model now leaves {quantity(held, unit, 3)}: it is at the noise floor."
    return f"The model now leaves {quantity(held, unit, 3)}, {number(held / floor, 3)} times the noise floor."


def model_effects(document: Document) -> list[str]:
    """Effects in the newest model, in the order in which they came."""
    ladder = document.get("ladder") or []
    return [str(name) for name in ladder[-1].get("effects", [])] if ladder else []


def candidate_rows(document: Document, most: int = 8) -> list[Row]:
    """What was tried, best first, with its evidence."""
    return [Row(str(item["effect"]), spaced(str(item["evidence"]))) for item in (document.get("candidates") or [])[:most]]


def look_alike_lines(document: Document) -> list[str]:
    """Runner-up, look-alikes and the next experiment."""
    lines = []
    runner = document.get("runner_up")
    if runner:
        lines.append(f"Runner-up: {spaced(_named(str(runner['effect']), str(runner['sentence'])))}")
    for item in document.get("look_alikes") or []:
        state = "told apart" if item["told_apart"] else "not told apart by these data"
        lines.append(spaced(f"Look-alike {item['effect']}, {state}: {item['sentence']}.".replace("..", ".")))
    if document.get("next_experiment"):
        lines.append(spaced(f"Next experiment: {document['next_experiment']}"))
    return lines


def ladder_words(document: Document) -> str:
    """The staircase for who cannot see it."""
    unit = str(document["error"]["unit"])
    rungs = [f"{str(rung['label']).replace('_', ' ')} {quantity(rung['held_out_error'], unit, 3)}" for rung in document.get("ladder") or []]
    floor = f"; noise floor {quantity(document['ladder'][-1]['noise_floor'], unit, 3)}" if rungs else ""
    return f"The error ladder of axis {document['axis']}, held-out: {', '.join(rungs) or 'no step yet'}{floor}."


def step_names(document: Document) -> dict[int, str]:
    """Steps that have pictures, by their place."""
    return {k: f"{k}: {str(step['label']).replace('_', ' ')}" for k, step in enumerate(document.get("steps") or []) if step.get("pictures")}


def _named(name: str, sentence: str) -> str:
    return sentence if name in sentence else f"{name}: {sentence}"


def spaced(sentence: str) -> str:
    """Names of effects as people write them: coulomb friction."""
    return re.sub(r"(?<=[a-z])_(?=[a-z])", " ", sentence)
