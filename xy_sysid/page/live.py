"""The running machine as a Source: stories come from the diagnoser, and orders go to it. Each axis has its own state."""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import dataclass, field
from typing import Any

from xy_sysid.axis.model import STANDARD
from xy_sysid.errors import BadInput
from xy_sysid.live.diagnoser import WAITS
from xy_sysid.live.plain_messages import topic_of
from xy_sysid.live.status_values import HEARD, KEPT, number, used
from xy_sysid.page.facts import seconds_text
from xy_sysid.page.link import Link
from xy_sysid.page.orders import Order, OrderKind, OrderState
from xy_sysid.page.topics_state import TopicsState

NODE = "diagnoser"
LONG = 600.0  # s that a diagnosis may take
SETTLES = 3.0  # s after an answer in which the diagnoser starts, or reports what it has done
LOST = 10.0  # s without an answer and without work of the diagnoser, after which the order is repeated
AGAIN = 2  # repetitions at most
ENOUGH = 10.0  # s of data after which the rigid model is fitted automatically, so that the first figure shows where it fails
NEWER = 1.0  # s of newer data from which the page mentions them
SERVICES = {"diagnose": "diagnose", "renew": "renew", "next": "add_next", "auto": "auto", "reset": "reset_model"}


@dataclass
class _Asked:
    """An order for one axis.

    before: the diagnoser's report on the axis at the time of the order; again: remaining repetitions
    settled: time of the answer, and the diagnoser's report then; wanted: parameters that were set
    """

    state: OrderState
    before: int
    again: int = AGAIN
    settled: tuple[float, int] = (math.inf, 0)
    wanted: dict[str, list[str]] = field(default_factory=dict)


class Live:
    """The machine's topics in one namespace, as a Source."""

    live = True
    key = "live"

    def __init__(self, heard: TopicsState, link: Link, say: Any) -> None:
        self.title, self.heard, self.link, self._say = "live", heard, link, say
        self._jobs: dict[str, _Asked] = {}
        self._asked = 0
        self._enough = ENOUGH
        self._numbers = itertools.count(1)

    def axes(self) -> tuple[str, ...]:
        """Axes named in any received message."""
        return self.heard.axes()

    def document(self, axis: str) -> dict[str, Any] | None:
        """The newest story."""
        return self.heard.stories.get(axis)

    def stamp(self, axis: str) -> int:
        """Counter that grows with each story of the axis and each change of its orders."""
        return self._done(axis) + self._asked

    def job(self, axis: str) -> OrderState | None:
        """The diagnoser's current work on the axis, or the newest order."""
        words, since = self.heard.doings.get(axis, ("", 0.0))
        if words and NODE in self.heard.present:
            return OrderState(order=Order(0, "diagnose", axis), begun=since, running=words != WAITS, said=words.replace("_", " "))
        asked = self._jobs.get(axis)
        if asked is not None:
            at, stamp = asked.settled
            if time.monotonic() - at > SETTLES or (self._news(axis) != stamp and math.isfinite(at)):
                self._set_again_or_end(axis, asked)
            elif asked.state.order.act in SERVICES:
                self._look_for_losses(axis, asked)
        asked = self._jobs.get(axis)
        return asked.state if asked is not None else None

    def _set_again_or_end(self, axis: str, asked: _Asked) -> None:
        """Set the effects again if the diagnoser has not started; it ignores effects that it already has. Otherwise end the order."""
        if self._done(axis) != asked.before:
            self._end(axis)
        elif asked.again:
            asked.again -= 1
            asked.settled = math.inf, 0
            self.link.set_parameters(NODE, asked.wanted, lambda done, words: self._set(axis, done, words))
        else:
            self._told(axis, False, "the model has these effects already; press Diagnose")

    def _look_for_losses(self, axis: str, asked: _Asked) -> None:
        """Repeat an order if the diagnoser is idle and has not answered: a loaded computer can lose a request or an answer."""
        waited = time.monotonic() - asked.state.begun
        if waited > LOST and self._done(axis) != asked.before:  # it has worked on the order: do not repeat it
            self._end(axis)
        elif asked.again and waited > LOST * (AGAIN + 1 - asked.again):
            asked.again -= 1
            self._trigger(asked.state.order)

    def begin(self) -> None:
        """Start the fit of the rigid model once there are enough data, if no other work was requested."""
        if not self.heard.stories and NODE in self.heard.present and self._kept() >= self._enough:
            self._enough = 2.0 * self._kept()
            self.link.trigger(f"{NODE}/begin", lambda done, words: None, LONG)

    def ready(self, axis: str) -> bool:
        """True if an order is possible: the diagnoser runs, and has a story or enough data of the axis."""
        return NODE in self.heard.present and (axis in self.heard.stories or self._kept() >= ENOUGH)

    def words(self, axis: str) -> str:
        """What the page waits for before there is a story, and for how long."""
        if NODE not in self.heard.present:
            return "The diagnoser does not answer. Start it with xy-sysid run, or record a bag and open it here."
        kept = self._kept()
        if kept <= 0.0:
            moves = "" if self.heard.driving() else " No axis is driven. Press Configure, then Activate."
            return f"Waiting for the first samples. After {ENOUGH:.0f} s of data the rigid model is fitted automatically.{moves}"
        if kept < ENOUGH:
            return f"{kept:.0f} of {ENOUGH:.0f} s of data have arrived; then the rigid model is fitted automatically."
        return f"{ENOUGH:.0f} s of data have arrived. The rigid model is being fitted, which takes a few seconds."

    def used(self, axis: str) -> str:
        """The time range of the story's data in s since the first sample, and the amount of newer data."""
        values = self.heard.values(NODE)
        document = self.document(axis)
        if document is None:
            return ""
        ends = [number(values, name) for name in used(axis)]
        if not all(math.isfinite(end) for end in ends):
            return f"Fitted to {float(document['seconds']):.0f} s of data that are no longer kept."
        newer = max(number(values, HEARD) - ends[1], 0.0)
        more = f"{seconds_text(newer)} of newer data have come." if newer >= NEWER else "They are the newest."
        return f"Fitted to seconds {ends[0]:.0f} to {ends[1]:.0f} of the data. {more}"

    def awaits(self, axis: str) -> bool:
        """True if the diagnoser runs or may still appear: until the identifier has published a response."""
        return NODE in self.heard.present or self.heard.table("frf", axis) is None

    def newer(self, axis: str) -> bool:
        """True if there are newer data than those of the story."""
        values = self.heard.values(NODE)
        end = number(values, used(axis)[1])
        return axis in self.heard.stories and not number(values, HEARD) < end + NEWER

    def effects(self) -> tuple[str, ...]:
        """Effects of the library; other effects of the diagnoser can be added with its parameter."""
        return tuple(effect.name for effect in STANDARD.acting)

    def problem(self) -> str:
        """Empty: lost nodes are reported elsewhere."""
        return ""

    def ask(self, act: OrderKind, axis: str, argument: str = "") -> None:
        """Send an order to the diagnoser."""
        asked = _Asked(OrderState(Order(next(self._numbers), act, axis, argument), time.monotonic(), None, True), self._done(axis))
        if act in ("add", "remove"):
            effects = self._effects(axis)
            if act == "add" and (argument in effects or not argument):
                raise BadInput("effect", repr(argument), "one that is not in the model yet", "Choose another.")
            wanted = [*effects, argument] if act == "add" else [name for name in effects if name != argument]
            asked.wanted = {f"effects.{axis}": wanted or [""]}
            self._jobs[axis] = asked
            self.link.set_parameters(NODE, asked.wanted, lambda done, words: self._set(axis, done, words))
        elif act in SERVICES:
            self._jobs[axis] = asked
            self._trigger(asked.state.order)
        else:
            raise BadInput("order", act, ", ".join(("add", "remove", *SERVICES)), "Record a bag and open it.")
        self._asked += 1

    def cancel(self, axis: str) -> None:
        """Cancel the diagnoser's work on the axis."""
        self.link.trigger(f"{NODE}/{topic_of('cancel', axis)}", lambda done, words: self._told(axis, done, words))

    def _trigger(self, order: Order) -> None:
        service, axis = topic_of(SERVICES[order.act], order.axis), order.axis
        self.link.trigger(f"{NODE}/{service}", lambda done, words: self._told(axis, done, words), LONG)

    def _told(self, axis: str, done: bool, words: str) -> None:
        self._end(axis)
        if not done:  # on success the story already shows it
            self._say(words or "the diagnoser refused", done)

    def _end(self, axis: str) -> None:
        self._jobs.pop(axis, None)
        self._asked += 1

    def _set(self, axis: str, done: bool, words: str) -> None:
        """Handle the answer to a changed parameter; the diagnoser starts the resulting work a moment later."""
        asked = self._jobs.get(axis)
        if done and not words and asked is not None:
            asked.settled = time.monotonic(), self._news(axis)
        else:
            self._told(axis, done, words)

    def _news(self, axis: str) -> int:
        """Counter that grows with each story of the axis."""
        return self.heard.version.get(f"story {axis}", 0)

    def _done(self, axis: str) -> int:
        """Counter that grows with each story and each report of the diagnoser's work on the axis."""
        return self._news(axis) + self.heard.version.get(f"progress {axis}", 0)

    def _kept(self) -> float:
        """s of data that the diagnoser keeps."""
        return number(self.heard.values(NODE), KEPT, 0.0)

    def _effects(self, axis: str) -> list[str]:
        ladder = (self.document(axis) or {}).get("ladder") or [{}]
        return [str(name) for name in ladder[-1].get("effects", [])]
