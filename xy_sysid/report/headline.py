"""A line that gives the state of an axis, a sentence below it, and the next action. Pure functions, shared by page and report."""

from __future__ import annotations

from typing import Any

from xy_sysid.report.story_parts import Document, words
from xy_sysid.report.story_words import confidence, status
from xy_sysid.report.words import moved, number
from xy_sysid.units import listed

NOTHING_YET = "Not fitted yet"
LACKING = "Not enough data"
MISSING = "Something is missing"
NOT_KNOWN = "Something is missing that is not in the library"
ENOUGH = "Nothing is missing"


def headline(document: Document | None, doing: str = "") -> str:
    """Something is missing -> Adding ... -> Explained: 18.7 → 0.33 mm/s. doing: the current activity; if given, the line shows only this."""
    if doing:
        return f"{doing[:1].upper()}{doing[1:]} ..."
    if document is None:
        return NOTHING_YET
    ladder = document["ladder"]
    if not ladder:
        return LACKING
    first, last = ladder[0], ladder[-1]
    kind, fall = status(document), _fall(document)
    if kind == "explained":
        return f"Explained: {fall}" if last["effects"] else f"{ENOUGH}: {_error(document, last)}"
    if kind == "partly explained":
        return f"Partly explained: {fall}"
    if document["verdict"] == "not_in_library":
        return NOT_KNOWN
    if document["verdict"] == "nothing_missing" and not last["effects"]:
        return f"{ENOUGH}: {_error(document, last)}"
    return f"{MISSING}: {_error(document, last)}, {_times(first if not last['effects'] else last)}"


def detail(document: Document) -> str:
    """The sentence below the headline: the residual error and its parts; before an effect is added, the result of the diagnosis."""
    ladder = document["ladder"]
    if not ladder:
        return str(document["sentence"])
    last = ladder[-1]
    if not last["effects"]:
        if document["verdict"] is None:
            return _fails(document)
        return f"{str(document['sentence']).rstrip()} {confidence(document)}".rstrip()
    names = listed([words(name) for name in last["effects"]])
    left = _error(document, last)
    if last["explained"]:
        return f"With {names} the residual error is {left}: it is at the noise floor ({_floor(document, last)})."
    return f"With {names} the residual error is {left}, {_times(last)} ({_floor(document, last)})."


def next_act(document: Document | None) -> tuple[str, str] | None:
    """The next action and its effect. Actions: diagnose, add, next, keep (the model); None if there is nothing to do."""
    if document is None or not document["ladder"]:
        return None
    last = document["ladder"][-1]
    if last["explained"] or (document["verdict"] == "nothing_missing" and not last["effects"]):
        return "keep", ""
    if document["verdict"] is None:
        return "diagnose", ""
    missing = [str(name) for name in document["effects"] if name not in last["effects"]]
    if missing:
        return "add", missing[0]
    return ("keep" if last["effects"] else "next", "") if document["note"] or document["verdict"] == "not_in_library" else ("next", "")


def worst(document: Document) -> dict[str, Any] | None:
    """The place where the newest model has the largest error; None if it fails nowhere."""
    pictures = document["steps"][-1]["pictures"] if document["steps"] else None
    failing = pictures["failing"] if pictures else []
    return max(failing, key=lambda item: float(item["error_over_floor"])) if failing else None


def _fails(document: Document) -> str:
    place = worst(document)
    if document["ladder"][-1]["explained"] or place is None:
        return "The error of the rigid model with delay is encoder noise."
    return f"The largest error of the rigid model with delay: {place['sentence']}."


def _fall(document: Document) -> str:
    """Error before and after: 18.7 → 0.33 mm/s."""
    first, last = (_error(document, item) for item in (document["ladder"][0], document["ladder"][-1]))
    before, _, unit = first.partition(" ")
    after, _, same = last.partition(" ")
    return f"{before} → {after} {unit}" if unit == same else f"{first} → {last}"


def _error(document: Document, item: Document) -> str:
    return moved(float(item["held_out_error"]), str(document["error"]["unit"]))


def _floor(document: Document, item: Document) -> str:
    return f"noise floor {moved(float(item['noise_floor']), str(document['error']['unit']))}"


def _times(item: Document) -> str:
    return f"{number(float(item['held_out_error']) / max(float(item['noise_floor']), 1e-300), 2)} times the noise floor"
