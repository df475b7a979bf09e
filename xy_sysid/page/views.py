"""The shown model of an axis: the story's newest, or without a story the identifier's linear fit; the user can choose others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.report.story_parts import words

NOW, RIGID, LINEAR = "now", "rigid", "linear"
AWAITED = "rigid, with delay"  # name of the first model of a story


@dataclass(frozen=True, slots=True)
class View:
    """A shown model. linear: True for the identifier's fit; step: index in the story, None for the newest."""

    linear: bool = False
    step: int | None = None


def views(document: Mapping[str, Any] | None, live: bool, awaited: bool = False) -> dict[str, str]:
    """The models to choose from, with their names; the first is the default. awaited: True if a rigid model will arrive."""
    steps = document["steps"] if document is not None else []
    found: dict[str, str] = {}
    if steps:
        found[NOW] = words(str(steps[-1]["label"]))
        if len(steps) > 1 and steps[-1]["effects"]:
            found[RIGID] = words(str(steps[0]["label"]))
    elif awaited:
        found[NOW] = AWAITED
    if live:
        found[LINEAR] = "linear fit"
    return found


def view_of(choice: str) -> View:
    """The view of a choice."""
    return View(linear=choice == LINEAR, step=0 if choice == RIGID else None)
