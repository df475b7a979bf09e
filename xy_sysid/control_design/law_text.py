"""Where a state holds what, and calls of the laws of effects as text: with the numbers of one model, or behind flags."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from xy_sysid.axis.loop_source import slots
from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect
from xy_sysid.effects._binding import call

X, V, Q = 0, 1, 2  # places in a state: position, speed, what hangs on it
NUMBERS = ("gain", "pole", "turn", "h_old", "h_new", "cuts_old", "cuts_new", "back_old", "back_new", "n", "ring", "shake")


@dataclass(frozen=True, slots=True)
class StateLayout:
    """Where a state holds what: position, speed and hanging masses first, then time, the ring's head, the effects' states, the ring."""

    effects: tuple[Effect, ...]
    hanging: int

    @property
    def time(self) -> int:
        """Place of the time, s."""
        return Q + self.hanging

    @property
    def head(self) -> int:
        """Place of the ring's head."""
        return self.time + 1

    def state(self, effect: Effect, name: str) -> int:
        """Place of a state of an effect."""
        before = [(own.name, key) for own in self.effects for key in own.states]
        return self.head + 1 + before.index((effect.name, name))

    @property
    def ring(self) -> int:
        """Place of the ring of voltages on their way."""
        return self.head + 1 + sum(len(effect.states) for effect in self.effects)


def given_numbers() -> dict[str, str]:
    """The numbers of a loop that takes them as ``z``."""
    whole = {"cuts_old", "cuts_new", "back_old", "back_new", "n", "ring"}
    return {name: f"int(z[{place}])" if name in whole else f"z[{place}]" for place, name in enumerate(NUMBERS)}


class LawText:
    """Writes calls of the laws of some effects: behind flags with the numbers of ``p``, or of one model with its numbers (``NUMBERS``, as text)."""

    def __init__(self, effects: Sequence[Effect], hanging: int, model: AxisModel | None = None, numbers: Mapping[str, str] | None = None) -> None:
        self.effects = tuple(effect for effect in effects if effect.category != "base")
        self.layout = StateLayout(self.effects, hanging)
        self.model = model
        self.guarded = model is None
        self.places = slots(self.effects)
        self.numbers = numbers or given_numbers()

    def of(self, *categories: str) -> list[Effect]:
        """The effects of some categories, in the direction of the signal."""
        return sorted((effect for effect in self.effects if effect.category in categories), key=lambda effect: (effect.order, effect.name))

    def call(self, effect: Effect, function: str, words: Mapping[str, str]) -> str:
        """A call of a law; words: what stands for each argument that is no parameter and no state."""
        own = {name: self._value(effect, name) for name in effect.names}
        states = {name: f"s[{self.layout.state(effect, name)}]" for name in effect.states}
        return call(effect, function, {"gain": self.numbers["gain"], "pole": self.numbers["pole"], **states, **words, **own})

    def _value(self, effect: Effect, name: str) -> str:
        if self.model is None:
            return f"p[{self.places[f'{effect.name}.{name}']}]"
        return repr(float(dict(self.model.effects)[effect.name][effect.names.index(name)]))

    def guard(self, effect: Effect, lines: list[str]) -> list[str]:
        """Lines that run only where the effect acts."""
        return [f"if {self.acts([effect])}:", *("    " + line for line in lines)] if self.guarded else lines

    def acts(self, effects: list[Effect]) -> str:
        """Whether one of the effects acts."""
        return " or ".join(f"on[{self.effects.index(effect)}] != 0" for effect in effects) or "False"


def indented(depth: int, lines: Sequence[str]) -> str:
    """Lines as a block of source."""
    return "\n".join("    " * depth + line for line in lines)
