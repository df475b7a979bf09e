"""Orders of a page and their progress, as plain values that are exchanged with the worker."""

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
    """One order for one axis; argument: the effect's name for add and remove; number: increases with every order."""

    number: int
    act: OrderKind
    axis: str = ""
    argument: str = ""

    @property
    def words(self) -> str:
        """The current activity in words."""
        return DOING[self.act].format(self.argument.replace("_", " "))


@dataclass
class Wish:
    """The last click during other work. It is carried out once, if its axis is still selected."""

    _kept: tuple[str, OrderKind, str] | None = None

    def keep(self, axis: str, act: OrderKind, argument: str = "") -> None:
        """Store the click."""
        self._kept = axis, act, argument

    def taken(self, axis: str) -> tuple[OrderKind, str] | None:
        """Return action and argument of the stored click for this axis and clear it; None without one."""
        kept, self._kept = self._kept, None
        return kept[1:] if kept is not None and kept[0] == axis else None

    @property
    def words(self) -> str:
        """The next action in words, shown after the current activity."""
        return "" if self._kept is None else f"; then {DOING[self._kept[1]].format(self._kept[2].replace('_', ' '))}"


@dataclass(frozen=True, slots=True)
class Reading:
    """How a recording is read. load: arguments of ``imports.load``; words: the same as command options; effect_files: the user's own effects."""

    load: Mapping[str, Any] = field(default_factory=dict)
    words: tuple[str, ...] = ()
    effect_files: tuple[Path, ...] = ()


def tables(given: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Arguments of ``imports.load`` from the options --map, --unit, --scale and --rate of a table. Raises BadInput for invalid values."""
    found: dict[str, Any] = {}
    for option, name in (("--map", "columns"), ("--unit", "units")):
        found |= {name: pairs(given[option], option)} if given.get(option) else {}
    found |= {"scales": numbers(given["--scale"], "--scale")} if given.get("--scale") else {}
    if given.get("--rate"):
        try:
            found["rate"] = float(given["--rate"][0])
        except ValueError:
            raise BadInput("--rate", repr(given["--rate"][0]), "a number", "Give the sampling rate in Hz.") from None
    FileReading(**found)  # refuses arguments that no reader accepts
    return found


def read_so(usual: Reading, words: Sequence[str]) -> Reading:
    """The default reading with additional table options: ("--map", "time=A", "--rate", "500"). Raises BadInput for invalid values."""
    given: dict[str, list[str]] = {}
    for option, text in zip(words[::2], words[1::2], strict=True):
        given.setdefault(option, []).append(text)
    return replace(usual, load={**usual.load, **tables(given)}, words=(*usual.words, *words))


@dataclass(frozen=True, slots=True)
class WorkerNews:
    """A message of the worker. kind: opened (axes in content), progress (part), story (document), done, failed."""

    kind: Literal["opened", "progress", "story", "done", "failed", "closed"]
    order: int = 0
    axis: str = ""
    words: str = ""
    part: float | None = None
    content: Any = None


@dataclass(frozen=True, slots=True)
class OrderState:
    """An order in progress or waiting; begun: seconds on the page's clock; part: 0..1, None if unknown."""

    order: Order
    begun: float
    part: float | None = None
    running: bool = False
    said: str = ""

    @property
    def words(self) -> str:
        """The current activity in words."""
        return self.said or self.order.words


class Source(Protocol):
    """Source of an axis's story: a recording, or the running machine."""

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
        """Counter that grows whenever the document or the jobs of the axis change."""
        ...

    def job(self, axis: str) -> OrderState | None:
        """The current or waiting order of the axis."""
        ...

    def ready(self, axis: str) -> bool:
        """True if an order is possible."""
        ...

    def words(self, axis: str) -> str:
        """The text to show while there is no story."""
        ...

    def effects(self) -> tuple[str, ...]:
        """Names of all effects that can be added."""
        ...

    def problem(self) -> str:
        """Why no more data will arrive; empty if there is no problem."""
        ...

    def ask(self, act: OrderKind, axis: str, argument: str = "") -> None:
        """Give an order; raises BadInput for an impossible one."""
        ...

    def cancel(self, axis: str) -> None:
        """Cancel the running work for the axis."""
        ...

    def used(self, axis: str) -> str:
        """The time range of the story's data, and whether newer data have arrived; empty for a recording."""
        ...

    def awaits(self, axis: str) -> bool:
        """True if a story of the axis will arrive by itself."""
        ...

    def newer(self, axis: str) -> bool:
        """True if there are newer data than those of the story."""
        ...
