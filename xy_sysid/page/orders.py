"""Orders of a page and their progress: plain values that go to the worker and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Protocol

from xy_sysid.errors import BadInput
from xy_sysid.imports.reading import Reading as FileReading
from xy_sysid.imports.reading import numbers, pairs

OrderKind = Literal["begin", "diagnose", "renew", "add", "remove", "next", "auto", "reset"]

DOING = {
    "begin": "fitting the rigid model",
    "diagnose": "diagnosing the missing effect",
    "renew": "fitting the model to the newest data",
    "add": "adding {}",
    "remove": "removing {}",
    "next": "finding the next effect",
    "auto": "adding effects until the floor is reached",
    "reset": "returning to the rigid model",
}


@dataclass(frozen=True, slots=True)
class Order:
    """One order for one axis; argument: the effect's name for add and remove. number: grows with every order."""

    number: int
    act: OrderKind
    axis: str = ""
    argument: str = ""

    @property
    def words(self) -> str:
        """What is being done."""
        return DOING[self.act].format(self.argument.replace("_", " "))


@dataclass
class Wish:
    """What was clicked while something else was being done, the last of it; it is taken once, if its axis is still the one that is shown."""

    _kept: tuple[str, OrderKind, str] | None = None

    def keep(self, axis: str, act: OrderKind, argument: str = "") -> None:
        """Note it until it is taken."""
        self._kept = axis, act, argument

    def taken(self, axis: str) -> tuple[OrderKind, str] | None:
        """Act and argument, if there is a wish for this axis; then there is none any more."""
        kept, self._kept = self._kept, None
        return kept[1:] if kept is not None and kept[0] == axis else None

    @property
    def words(self) -> str:
        """What comes next, behind what is being done."""
        return "" if self._kept is None else f"; then {DOING[self._kept[1]].format(self._kept[2].replace('_', ' '))}"


@dataclass(frozen=True, slots=True)
class Reading:
    """How a recording is read. load: arguments of ``imports.load``; words: the same for a command; effect_files: effects of one's own."""

    load: Mapping[str, Any] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    effect_files: tuple[Path, ...] = ()


def tables(given: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Arguments of ``imports.load`` of the options --map, --unit, --scale and --rate of a table. Raises BadInput for what they do not take."""
    found: dict[str, Any] = {}
    for option, name in (("--map", "columns"), ("--unit", "units")):
        found |= {name: pairs(given[option], option)} if given.get(option) else {}
    found |= {"scales": numbers(given["--scale"], "--scale")} if given.get("--scale") else {}
    if given.get("--rate"):
        try:
            found["rate"] = float(given["--rate"][0])
        except ValueError:
            raise BadInput("--rate", repr(given["--rate"][0]), "a number", "Give the sampling rate in Hz.") from None
    FileReading(**found)  # refuses what no reader takes
    return found


def read_so(usual: Reading, words: Sequence[str]) -> Reading:
    """The usual reading with options of a table in words: ("--map", "time=A", "--rate", "500"). Raises BadInput for what they do not take."""
    given: dict[str, list[str]] = {}
    for option, text in zip(words[::2], words[1::2], strict=True):
        given.setdefault(option, []).append(text)
    return replace(usual, load={**usual.load, **tables(given)}, words=(*usual.words, *words))


@dataclass(frozen=True, slots=True)
class WorkerNews:
    """What the worker says. kind: opened (axes in content), progress (part), story (document), done, failed."""

    kind: Literal["opened", "progress", "story", "done", "failed", "closed"]
    order: int = 0
    axis: str = ""
    words: str = ""
    part: float | None = None
    content: Any = None


@dataclass(frozen=True, slots=True)
class OrderState:
    """An order that is being fulfilled or waits; begun: seconds on the page's clock; part: 0..1, None if unknown."""

    order: Order
    begun: float
    part: float | None = None
    running: bool = False
    said: str = ""

    @property
    def words(self) -> str:
        """What is being done."""
        return self.said or self.order.words


class Source(Protocol):
    """Where an axis' story comes from: a recording, or the machine as it runs."""

    key: str
    title: str
    live: bool

    def axes(self) -> tuple[str, ...]:
        """Its axes, in order."""
        ...

    def document(self, axis: str) -> dict[str, Any] | None:
        """The story as it is now."""
        ...

    def stamp(self, axis: str) -> int:
        """Grows whenever the document or the jobs of the axis change."""
        ...

    def job(self, axis: str) -> OrderState | None:
        """What is being done for the axis."""
        ...

    def ready(self, axis: str) -> bool:
        """Whether something can be asked for."""
        ...

    def words(self, axis: str) -> str:
        """What there is to say while there is no story."""
        ...

    def effects(self) -> tuple[str, ...]:
        """Names of all effects that can be added."""
        ...

    def problem(self) -> str:
        """Why there is nothing (more) to come; empty while all is well."""
        ...

    def ask(self, act: OrderKind, axis: str, argument: str = "") -> None:
        """Order something; raises BadInput for what cannot be asked for."""
        ...

    def cancel(self, axis: str) -> None:
        """Leave what is being done for the axis."""
        ...

    def used(self, axis: str) -> str:
        """Which seconds of the data the story is about, and whether newer ones have come; empty where that is no question."""
        ...

    def awaits(self, axis: str) -> bool:
        """Whether a story of the axis will come by itself."""
        ...

    def newer(self, axis: str) -> bool:
        """Whether there are newer data than those of the story."""
        ...
