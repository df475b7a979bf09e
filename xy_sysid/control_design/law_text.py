"""Layout of a state, and calls of the effects' laws as text: with the numbers of one model, or behind flags."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from xy_sysid.axis.loop_source import slots
from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect
from xy_sysid.effects._binding import call

Q = 2  # index in a state of the attached masses, after position and speed
NUMBERS = ("gain", "pole", "turn", "h_old", "h_new", "cuts_old", "cuts_new", "back_old", "back_new", "n", "ring", "shake")
WHOLE_NUMBERS = frozenset({"cuts_old", "cuts_new", "back_old", "back_new", "n", "ring"})


@dataclass(frozen=True, slots=True)
class StateLayout:
    """Layout of a state: position, speed and attached masses first, then time, the ring's head, the effects' states, the ring."""

    effects: tuple[Effect, ...]
    hanging: int

    @property
    def time(self) -> int:
        """Index of the time, s."""
        return Q + self.hanging

    @property
    def head(self) -> int:
        """Index of the ring's head."""
        return self.time + 1

    def state(self, effect: Effect, name: str) -> int:
        """Index of a state of an effect."""
        before = [(own.name, key) for own in self.effects for key in own.states]
        return self.head + 1 + before.index((effect.name, name))

    @property
    def ring(self) -> int:
        """Index of the ring of delayed voltages."""
        return self.head + 1 + sum(len(effect.states) for effect in self.effects)


def given_numbers() -> dict[str, str]:
    """The numbers of a loop that takes them as ``z``."""
    return {name: f"int(z[{place}])" if name in WHOLE_NUMBERS else f"z[{place}]" for place, name in enumerate(NUMBERS)}


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
        """The effects of some categories, in the order of the signal path."""
        return sorted((effect for effect in self.effects if effect.category in categories), key=lambda effect: (effect.order, effect.name))

    def call(self, effect: Effect, function: str, words: Mapping[str, str]) -> str:
        """A call of a law; words: text for each argument that is neither a parameter nor a state."""
        own = {name: self._value(effect, name) for name in effect.names}
        states = {name: f"s[{self.layout.state(effect, name)}]" for name in effect.states}
        return call(effect, function, {"gain": self.numbers["gain"], "pole": self.numbers["pole"], **states, **words, **own})

    def _value(self, effect: Effect, name: str) -> str:
        if self.model is None:
            return f"p[{self.places[f'{effect.name}.{name}']}]"
        return repr(float(dict(self.model.effects)[effect.name][effect.names.index(name)]))

    def guard(self, effect: Effect, lines: list[str]) -> list[str]:
        """Lines that run only if the effect is active."""
        return [f"if {self.acts([effect])}:", *("    " + line for line in lines)] if self.guarded else lines

    def acts(self, effects: list[Effect]) -> str:
        """An expression that is true if one of the effects is active."""
        return " or ".join(f"on[{self.effects.index(effect)}] != 0" for effect in effects) or "False"


def indented(depth: int, lines: Sequence[str]) -> str:
    """Lines as a block of source."""
    return "\n".join("    " * depth + line for line in lines)
