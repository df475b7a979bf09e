"""What a search needs to know of an axis: moves from one set of effects to another, and how a judge answers about sets.

It names no machine, so that a search can be tested with a judge that is a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Protocol, TypeVar


@dataclass(frozen=True, slots=True)
class Move:
    """From one set of effects to another.

    gain, rest: nats that the score test promises, of excess and of the whole error
    begins: excess with which it begins, where that is known (else infinite)
    parameters: that the new set has more; starts: first values of what is new; replaced: an effect that gives way
    expected: every machine has it (friction): it comes first among moves that promise the same, and is tried whatever the whole error promises,
        for to first order its trace tells little where it bends
    simpler: for a richer law of friction the set with the simplest in its place, else empty
    stays: parts of what is replaced that stay beside what takes its place, with their values
    """

    effects: frozenset[str]
    gain: float
    rest: float
    parameters: int
    starts: tuple[tuple[str, tuple[float, ...]], ...]
    replaced: str | None = None
    begins: float = inf
    expected: bool = False
    simpler: frozenset[str] = frozenset()
    stays: tuple[tuple[str, tuple[float, ...]], ...] = ()


class Judged(Protocol):
    """What the search needs to know of a fit."""

    @property
    def excess(self) -> float:
        """nats; 0 is nothing left."""


F = TypeVar("F", bound=Judged)


class Judge(Protocol[F]):
    """What the search asks; see ``axis_judge.AxisJudge``."""

    def moves(self, now: F, brief: F) -> Sequence[Move]:
        """What may be done next from a set. brief: its quick fit."""

    def slow_moves(self, now: F, brief: F) -> Sequence[Move]:
        """The same by what only all data show."""

    def taken_for(self, now: F) -> Sequence[Move]:
        """What may stand in the place of an effect, whose trace is a reason to try it."""

    def brief(self, now: F, move: Move, hopeless: float = inf) -> F | None:
        """A quick fit."""

    def merged(self, now: F, others: F) -> F | None:
        """A quick fit of one set with the effects of another, from what either has come to."""

    def whole(self, found: F) -> F:
        """The same on all data."""

    def refusal(self, found: F) -> str:
        """Why it explains nothing, or empty."""

    def size(self, found: F, before: F) -> float:
        """What a fit explains of what one before it left, over what it leaves itself."""
