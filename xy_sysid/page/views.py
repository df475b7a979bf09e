"""Which model of an axis is shown: the story's newest once there is a story, else the identifier's linear fit; others by a click."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.report.story_parts import words

NOW, RIGID, LINEAR = "now", "rigid", "linear"
AWAITED = "rigid, with delay"  # how the first model of a story is called


@dataclass(frozen=True, slots=True)
class View:
    """linear: what the identifier publishes; step: of the story, None for the newest."""

    linear: bool = False
    step: int | None = None


def views(document: Mapping[str, Any] | None, live: bool, awaited: bool = False) -> dict[str, str]:
    """What can be chosen, with its name; the first is what is shown unasked. awaited: the rigid model will come."""
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
