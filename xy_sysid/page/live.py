"""The machine as it runs, as a Source: stories come from the diagnoser, and what is asked for goes to it."""

from __future__ import annotations

import itertools
import math
import re
import time
from typing import Any

from xy_sysid.axis.model import STANDARD
from xy_sysid.errors import BadInput
from xy_sysid.page.link import Link
from xy_sysid.page.orders import Order, OrderKind, OrderState
from xy_sysid.page.topics_state import TopicsState

NODE = "diagnoser"
LONG = 600.0  # s that a diagnosis may take
SETTLES = 3.0  # s after an answer in which the diagnoser begins, or has said what it has done
LOST = 10.0  # s without an answer and without work of the diagnoser after which it is asked again,
AGAIN = 2  # times
ENOUGH = 10.0  # s of data with which the rigid model is fitted unasked, so that the first picture shows where it fails
SERVICES = {"diagnose": "diagnose", "next": "add_next", "auto": "auto", "reset": "reset_model"}
AXIS = re.compile(r"axis (\S+): (.*)")


class Live:
    """Topics of one namespace."""

    live = True
    key = "live"

    def __init__(self, heard: TopicsState, link: Link, say: Any) -> None:
        self.title, self.heard, self.link, self._say = "live", heard, link, say
        self._job: OrderState | None = None
        self._asked = 0
        self._again, self._before = 0, 0  # times that a question may be asked once more; what the diagnoser had said when it was asked
        self._settled = (math.inf, 0)  # when the last order was answered, and the stamp then
        self._enough = ENOUGH
        self._numbers = itertools.count(1)
        self._wanted: dict[str, list[str]] = {}

    def axes(self) -> tuple[str, ...]:
        """Axes of which something was heard."""
        return self.heard.axes()

    def document(self, axis: str) -> dict[str, Any] | None:
        """The newest story."""
        return self.heard.stories.get(axis)

    def stamp(self, axis: str) -> int:
        """Grows with each story and each change of what is done."""
        return self.heard.version.get(f"story {axis}", 0) + self.heard.version.get("progress", 0) + self._asked

    def job(self, axis: str) -> OrderState | None:
        """What the diagnoser says that it does, for any axis, or what it was asked for a moment ago."""
        words, since = self.heard.progress
        if words and NODE in self.heard.present:
            told = AXIS.fullmatch(words)
            own, said = (told.group(1), told.group(2)) if told else (axis, words)
            return OrderState(order=Order(0, "diagnose", own), begun=since, part=None, running=True, said=said.replace("_", " "))
        at, stamp = self._settled
        if self._job is not None and (time.monotonic() - at > SETTLES or (self._news() != stamp and math.isfinite(at))):
            self._set_again_or_end()
        if self._job is not None and self._job.order.act in SERVICES:
            self._look_for_losses(self._job)
        return self._job

    def _set_again_or_end(self) -> None:
        """The effects are set. Where the diagnoser has not begun with them they are set once more, which it does nothing about if it has them."""
        if self._done() != self._before:
            self._job = None
        elif self._again:
            self._again -= 1
            self._settled = math.inf, 0
            self.link.set_parameters(NODE, self._wanted, self._set)
        else:
            self._told(False, "the diagnoser has the effects that are wanted, and does nothing; press Diagnose")

    def _look_for_losses(self, job: OrderState) -> None:
        """The diagnoser is idle and has not answered: either the answer was lost, or the question, as on a computer under load."""
        waited = time.monotonic() - job.begun
        if waited > LOST and self._done() != self._before:  # it has worked: never asked for twice
            self._job = None
        elif self._again and waited > LOST * (AGAIN + 1 - self._again):
            self._again -= 1
            self.link.trigger(f"{NODE}/{SERVICES[job.order.act]}", self._told, LONG)

    def begin(self) -> None:
        """Have the rigid model fitted, once there are data for it and nobody has asked for more."""
        kept = self.heard.values(NODE).get("seconds kept (s)", "0")
        if not self.heard.stories and NODE in self.heard.present and float(kept) >= self._enough:
            self._enough = 2.0 * float(kept)
            self.link.trigger(f"{NODE}/begin", lambda done, words: None, LONG)

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

    def ask(self, act: OrderKind, axis: str, argument: str = "") -> None:
        """Pass it on to the diagnoser."""
        if act in ("add", "remove"):
            effects = self._effects(axis)
            if act == "add" and (argument in effects or not argument):
                raise BadInput("effect", repr(argument), "one that is not in the model yet", "Choose another.")
            wanted = [*effects, argument] if act == "add" else [name for name in effects if name != argument]
            self._wanted = {f"effects.{axis}": wanted or [""]}
            self.link.set_parameters(NODE, self._wanted, self._set)
        elif act in SERVICES:
            self.link.trigger(f"{NODE}/{SERVICES[act]}", self._told, LONG)
        else:
            raise BadInput("order", act, ", ".join(("add", "remove", *SERVICES)), "Record a bag and open it for that.")
        self._again, self._before = AGAIN, self._done()
        self._job, self._settled = OrderState(Order(next(self._numbers), act, axis, argument), time.monotonic(), None, True), (math.inf, 0)
        self._asked += 1

    def cancel(self, axis: str) -> None:
        """Leave what the diagnoser does."""
        self.link.trigger(f"{NODE}/cancel", self._told)

    def _told(self, done: bool, words: str) -> None:
        self._job = None
        self._asked += 1
        if not done:  # what was done stands in the story
            self._say(words or "the diagnoser refused", done)

    def _set(self, done: bool, words: str) -> None:
        """A parameter is set at once; what follows from it begins a moment later."""
        if done and not words:
            self._settled = time.monotonic(), self._news()
        else:
            self._told(done, words)

    def _news(self) -> int:
        """Grows with each story of any axis."""
        return sum(number for name, number in list(self.heard.version.items()) if name.startswith("story "))

    def _done(self) -> int:
        """Grows with each story, and with whatever the diagnoser says that it does."""
        return self._news() + self.heard.version.get("progress", 0)

    def _effects(self, axis: str) -> list[str]:
        ladder = (self.document(axis) or {}).get("ladder") or [{}]
        return [str(name) for name in ladder[-1].get("effects", [])]
