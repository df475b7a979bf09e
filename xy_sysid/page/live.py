"""The machine as it runs, as a Source: stories come from the diagnoser, and what is asked for goes to it."""

from __future__ import annotations

import itertools
import time
from typing import Any

from xy_sysid.errors import BadInput
from xy_sysid.page.heard import Heard
from xy_sysid.page.link import Link, Told
from xy_sysid.page.wishes import Act, Job, Wish

NODE = "diagnoser"
SERVICES = {"diagnose": "diagnose", "next": "add_next", "auto": "auto", "reset": "reset_model"}


class Live:
    """Topics of one namespace."""

    live = True
    key = "live"

    def __init__(self, heard: Heard, link: Link, say: Any) -> None:
        self.title, self.heard, self.link, self._say = "live", heard, link, say
        self._jobs: dict[str, Job] = {}
        self._numbers = itertools.count(1)

    def axes(self) -> tuple[str, ...]:
        """Axes of which something was heard."""
        return self.heard.axes()

    def document(self, axis: str) -> dict[str, Any] | None:
        """The newest story."""
        return self.heard.stories.get(axis)

    def stamp(self, axis: str) -> int:
        """Grows with each story and each change of a job."""
        job = self.job(axis)
        return 2 * self.heard.version.get(f"story {axis}", 0) + (1 if job else 0)

    def job(self, axis: str) -> Job | None:
        """What the diagnoser says that it does, or what it was asked for a moment ago."""
        values = self.heard.values(f"diagnoser {axis}") or self.heard.values(NODE)
        doing = values.get(f"{axis} doing", values.get("doing", ""))
        if doing:
            begun = time.monotonic() - _float(values.get("seconds", "0"))
            return Job(Wish(0, "diagnose", axis, doing), begun, None, True)
        return self._jobs.get(axis)

    def problem(self) -> str:
        """The nodes that are lost are told elsewhere."""
        return ""

    def ask(self, act: Act, axis: str, argument: str = "") -> None:
        """Pass it on to the diagnoser."""
        wish = Wish(next(self._numbers), act, axis, argument)
        if act in ("add", "remove"):
            effects = self._effects(axis)
            if act == "add" and argument in effects:
                raise BadInput("effect", argument, "one that is not in the model yet", "Choose another.")
            wanted = [*effects, argument] if act == "add" else [name for name in effects if name != argument]
            self.link.set_parameters(NODE, {f"effects.{axis}": wanted or [""]}, self._told(axis))
        elif act in SERVICES:
            self.link.trigger(f"{NODE}/{SERVICES[act]}", self._told(axis))
        else:
            raise BadInput("order", act, ", ".join(("add", "remove", *SERVICES)), "Record a bag and open it for that.")
        self._jobs[axis] = Job(wish, time.monotonic(), None, True)

    def cancel(self, axis: str) -> None:
        """Leave what the diagnoser does."""
        self.link.trigger(f"{NODE}/cancel", self._told(axis))

    def _effects(self, axis: str) -> list[str]:
        ladder = (self.document(axis) or {}).get("ladder") or [{}]
        return [str(name) for name in ladder[-1].get("effects", [])]

    def _told(self, axis: str) -> Told:
        def told(done: bool, words: str) -> None:
            self._jobs.pop(axis, None)
            if words or not done:
                self._say(f"axis {axis}: {words or 'the diagnoser refused'}", done)

        return told


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
