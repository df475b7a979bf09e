"""The machine as it runs, as a Source: stories come from the diagnoser, and what is asked for goes to it."""

from __future__ import annotations

import itertools
import time
from typing import Any

from xy_sysid.axis_model import STANDARD
from xy_sysid.errors import BadInput
from xy_sysid.page.heard import Heard
from xy_sysid.page.link import Link
from xy_sysid.page.wishes import Act, Job, Wish

NODE = "diagnoser"
LONG = 600.0  # s that a diagnosis may take
SERVICES = {"diagnose": "diagnose", "next": "add_next", "auto": "auto", "reset": "reset_model"}


class Live:
    """Topics of one namespace."""

    live = True
    key = "live"

    def __init__(self, heard: Heard, link: Link, say: Any) -> None:
        self.title, self.heard, self.link, self._say = "live", heard, link, say
        self._job: Job | None = None
        self._asked = 0
        self._numbers = itertools.count(1)

    def axes(self) -> tuple[str, ...]:
        """Axes of which something was heard."""
        return self.heard.axes()

    def document(self, axis: str) -> dict[str, Any] | None:
        """The newest story."""
        return self.heard.stories.get(axis)

    def stamp(self, axis: str) -> int:
        """Grows with each story and each change of what is done."""
        versions = self.heard.version
        return versions.get(f"story {axis}", 0) + versions.get("progress", 0) + self._asked

    def job(self, axis: str) -> Job | None:
        """What the diagnoser says that it does, for any axis, or what it was asked for a moment ago."""
        words, since = self.heard.progress
        if words and NODE in self.heard.present:
            return Job(Wish(0, "diagnose", axis), since, None, True, words.replace("_", " "))
        return self._job

    def ready(self, axis: str) -> bool:
        """Whether something can be asked for: the diagnoser is there."""
        return NODE in self.heard.present

    def words(self, axis: str) -> str:
        """What there is to say before there is a story."""
        if NODE not in self.heard.present:
            return "The diagnoser is not running: start it with xy-sysid run, or record a bag and open it here."
        kept = self.heard.values(NODE).get("seconds kept (s)", "0")
        return f"Not diagnosed yet. {float(kept):.0f} s of data are kept; press Diagnose."

    def effects(self) -> tuple[str, ...]:
        """The library; what the diagnoser has besides can be added with its parameter."""
        return tuple(effect.name for effect in STANDARD.acting)

    def problem(self) -> str:
        """The nodes that are lost are told elsewhere."""
        return ""

    def ask(self, act: Act, axis: str, argument: str = "") -> None:
        """Pass it on to the diagnoser."""
        if act in ("add", "remove"):
            effects = self._effects(axis)
            if act == "add" and (argument in effects or not argument):
                raise BadInput("effect", repr(argument), "one that is not in the model yet", "Choose another.")
            wanted = [*effects, argument] if act == "add" else [name for name in effects if name != argument]
            self.link.set_parameters(NODE, {f"effects.{axis}": wanted or [""]}, self._told)
        elif act in SERVICES:
            self.link.trigger(f"{NODE}/{SERVICES[act]}", self._told, LONG)
        else:
            raise BadInput("order", act, ", ".join(("add", "remove", *SERVICES)), "Record a bag and open it for that.")
        self._job = Job(Wish(next(self._numbers), act, axis, argument), time.monotonic(), None, True)
        self._asked += 1

    def cancel(self, axis: str) -> None:
        """Leave what the diagnoser does."""
        self.link.trigger(f"{NODE}/cancel", self._told)

    def _told(self, done: bool, words: str) -> None:
        self._job = None
        self._asked += 1
        if words or not done:
            self._say(words or "the diagnoser refused", done)

    def _effects(self, axis: str) -> list[str]:
        ladder = (self.document(axis) or {}).get("ladder") or [{}]
        return [str(name) for name in ladder[-1].get("effects", [])]
