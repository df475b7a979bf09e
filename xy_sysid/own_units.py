"""Units of a recording in an answer: the models work in V and m whatever the numbers are, so A and rad only change names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

WORDS = ("sentence", "evidence", "note", "experiment")  # keys of a document whose text may name a length or a speed


def in_units(document: Mapping[str, Any], units: tuple[str, str]) -> dict[str, Any]:
    """The same document with V and m named as the input's and the output's unit, in every ``unit`` and in sentences."""
    if units == ("V", "m"):
        return dict(document)
    return {key: _named(key, value, units) for key, value in document.items()}


def unit_in(unit: str, units: tuple[str, str]) -> str:
    """One unit: m/s/V becomes rad/s/A."""
    return re.sub(r"\bV\b|\bm\b", lambda found: units[0] if found.group() == "V" else units[1], unit)


def text_in(text: str, units: tuple[str, str]) -> str:
    """A sentence: 3 mm/s at 2 V becomes 3 mrad/s at 2 A."""
    return re.sub(r"(?<=\d )V\b", units[0], re.sub(r"\bmm\b", f"m{units[1]}", text))


def _named(key: str, value: Any, units: tuple[str, str]) -> Any:
    if isinstance(value, Mapping):
        return {name: _named(name, item, units) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_named(key, item, units) for item in value]
    if isinstance(value, str) and key == "unit":
        return unit_in(value, units)
    return text_in(value, units) if isinstance(value, str) and key in WORDS else value
