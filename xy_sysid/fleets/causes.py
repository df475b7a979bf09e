"""From simultaneous changes to the likely cause: a table that users can extend."""

from __future__ import annotations

from collections.abc import Collection
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Literal

from xy_sysid.bags.opening import yaml_of
from xy_sysid.errors import BadInput
from xy_sysid.settings import Settings, build, knob

Direction = Literal["up", "down"]
Moves = Collection[tuple[str, Direction]]
OURS = Path(__file__).with_name("causes.yaml")
DIRECTIONS = ("up", "down", "changed")


class Cause(Settings):
    """One cause and its signs."""

    cause: str = knob("", "what may have happened")
    when: list[str] = knob([], "changes that must all be there: QUANTITY up, down or changed")
    also: list[str] = knob([], "changes that go with it")
    check: str = knob("", "what to look at")


class Causes(Settings):
    """The table; see causes.yaml."""

    quantities: dict[str, list[str]] = knob({}, "columns of the table that measure a quantity")
    causes: list[Cause] = knob([], "in the order in which they are tried")

    def quantity(self, column: str) -> str:
        """The quantity that a column measures; its own name if the table has none."""
        return next((name for name, patterns in self.quantities.items() if any(fnmatchcase(column, one) for one in patterns)), column)

    def likeliest(self, moves: Moves) -> Cause | None:
        """The cause that explains most of the changes; moves: (column, direction). None if no cause explains any."""
        seen = {(self.quantity(column), direction) for column, direction in moves}
        fitting = [one for one in self.causes if all(_seen(change, seen) for change in one.when)]
        return max(fitting, key=lambda one: (sum(_explains(one, move) for move in seen), len(one.when)), default=None)


def causes(own: Path | str | None = None) -> Causes:
    """The package's table, preceded by the quantities and causes of a user's file. Raises BadRecording or BadInput."""
    ours = _read(OURS)
    if own is None:
        return ours
    theirs = _read(Path(own))
    quantities = {**theirs.quantities, **ours.quantities, **theirs.quantities}  # the user's patterns are tried first and take precedence
    both = Causes(quantities=quantities, causes=[*theirs.causes, *ours.causes])
    for number, one in enumerate(theirs.causes, 1):
        if not one.cause:
            raise BadInput(f"{own}: cause {number}", "without a name", "one with a name", "Write what may have happened: cause: a worn nut.")
        if not one.when:
            raise BadInput(f"{own}: when of {one.cause!r}", "empty", "one change or more", "Write the change that points to it, such as gain down.")
        for change in (*one.when, *one.also):
            name, _, direction = change.rpartition(" ")
            if name not in both.quantities or direction not in DIRECTIONS:
                allowed = f"one of {', '.join(both.quantities)}, then up, down or changed"
                raise BadInput(f"{own}: change", repr(change), allowed, "Name its columns under quantities.")
    return both


def _read(path: Path) -> Causes:
    found = yaml_of(path, "a table of causes")
    return build(Causes, found if isinstance(found, dict) else {"causes": found}, str(path))


def _seen(change: str, seen: Collection[tuple[str, str]]) -> bool:
    return any(_is(change, move) for move in seen)


def _explains(cause: Cause, move: tuple[str, str]) -> bool:
    return any(_is(change, move) for change in (*cause.when, *cause.also))


def _is(change: str, move: tuple[str, str]) -> bool:
    name, _, direction = change.rpartition(" ")
    return name == move[0] and direction in ("changed", move[1])
