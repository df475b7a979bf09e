"""The text of one sample of an axis model, written from the laws of its effects.

The same lines are compiled here with every effect of the library behind a flag (``sample_step``), and printed in other languages with the
effects and numbers of one model (``to_c`` and the like). So they use numbers, loops and flat arrays only, and a printed simulation equals this
one. Laws that depend on position use the simulated position; in ``axis.model`` they use the recorded one.
"""

from __future__ import annotations

from xy_sysid.axis.loop_source import heeds_speed, needs_speed
from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.law_text import LawText, indented
from xy_sysid.control_design.series import TERMS
from xy_sysid.control_design.step_template import BRISTLED, DRY, FREE, PLAIN, TEMPLATE
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import arguments


class StepText(LawText):
    """Writes the sample step."""

    def text(self, name: str) -> str:
        """Source of ``name(u, p, on, z, a, still, s, w)``, or for one model of ``name(u, a, still, s, w)``: the position shown after the sample.

        u: voltage to be held for the sample, V; p: the library's parameters; on: flags of effects; z: ``NUMBERS``; a, still: generators of the
        moving and the sticking axis, by rows; s: the state, which is updated; w: scratch array of ``TERMS`` n numbers
        """
        at = self.layout
        return TEMPLATE.substitute(
            name=name,
            signature="u, p, on, z, a, still, s, w" if self.guarded else "u, a, still, s, w",
            head=at.head,
            time=at.time,
            first=at.ring,
            inputs=indented(1, ["held = u", *self._inputs()]),
            advance=indented(3, self._advance()),
            pulls=indented(3, self._forces("pull", False, "v")),
            move=indented(3, self._move()),
            shown=self._shown(),
            **{key: self.numbers[key] for key in ("cuts_old", "cuts_new", "h_old", "h_new", "back_old", "back_new", "ring")},
        )

    def _shown(self) -> str:
        terms = [
            self._if(effect, f"({self.call(effect, 'error', {'x': 'x'})} - {self.call(effect, 'error', {'x': '0.0'})})")
            for effect in self.of("encoder")
        ]
        return " + ".join(["x", *terms])

    def _if(self, effect: Effect, value: str) -> str:
        return f"({value} if {self.acts([effect])} else 0.0)" if self.guarded else value

    def _inputs(self) -> list[str]:
        lines: list[str] = []
        for effect in self.of("input"):
            words = {"u": "held", "t": f"s[{self.layout.time}]", "x": "s[0]"}
            lines += self.guard(effect, [f"held = {self.call(effect, 'output', words)}"])
        return lines

    def _advance(self) -> list[str]:
        lines: list[str] = []
        for effect in self.of("state"):
            targets = ", ".join(["drive", *(f"s[{self.layout.state(effect, state)}]" for state in effect.states)])
            words = {"u": "drive", "v": "v", "x": "place", "t": "time", "h": "h"}
            lines += self.guard(effect, [f"{targets} = {self.call(effect, 'advance', words)}"])
        return lines

    def _forces(self, total: str, of_speed: bool, speed: str) -> list[str]:
        lines: list[str] = []
        for effect in self.of("force"):
            if needs_speed(effect) == of_speed:
                words = {"u": "drive", "v": speed, "x": "place", "t": "time"}
                lines += self.guard(effect, [f"{total} += {self.call(effect, 'force', words)}"])
        return lines

    def _levels(self, speed: str) -> list[str]:
        lines: list[str] = []
        for effect in self.of("friction"):
            words = {"u": "drive", "v": speed, "direction": "direction"}
            lines += self.guard(effect, [f"level += {self.call(effect, 'level', words)}"])
        return lines

    def _bristles(self, function: str, speed: str) -> list[str]:
        lines: list[str] = []
        for effect in self.of("bristle"):
            words = {"v": speed, "h": "0.5 * h", "level": "level"}
            state = f"s[{self.layout.state(effect, effect.states[0])}]"
            value = self.call(effect, function, words)
            lines += self.guard(effect, [f"{state} = {value}" if function == "bend" else f"force -= {self.numbers['turn']} * {value}"])
        return lines

    def _move(self) -> list[str]:
        drags = self._forces("drag", True, "v")
        parts = {
            "drag_middle": self._forces("drag", True, "middle"),
            "rest": self._levels("0.0"),
            "level_start": self._levels("v"),
            "level_middle": self._levels("middle"),
            "first": self._bristles("force", "v"),
            "bend_first": self._bristles("bend", "0.5 * (v + middle)"),
            "forces": self._bristles("force", "middle"),
            "bend_last": self._bristles("bend", "0.5 * (middle + s[1])"),
        }
        words = {"a": "a", "still": "still", "n": self.numbers["n"], "turn": self.numbers["turn"]}
        start = ["drag = 0.0", *drags]
        bristles, dry = self.of("bristle"), self.of("friction")
        bristled = [*self._direction(), *_filled(BRISTLED, words, parts)]
        rubbing = _filled(DRY, words, parts)
        if self.guarded:
            branches = [
                f"if {self.acts(bristles)}:",
                *("    " + line for line in bristled),
                f"elif {self.acts(dry)}:",
                *("    " + line for line in rubbing),
                "else:",
                *("    " + line for line in _filled(FREE, words, parts)),
            ]
            return [*start, *branches]
        if bristles:
            return [*start, *bristled]
        if dry:
            return [*start, *rubbing]
        return [*start, *_filled(FREE, words, parts)] if drags else _filled(PLAIN, words, parts)

    def _direction(self) -> list[str]:
        """Other dry friction together with bristles scales the level at which they slide."""
        lines = ["direction = 1.0", f"if v < 0.0 or (v == 0.0 and (push - drag) * {self.numbers['turn']} < 0.0):", "    direction = -1.0"]
        return [*lines, "level = 0.0", *self._levels("v")] if self.of("friction") else ["level = 0.0"]


def heeds(model: AxisModel) -> bool:
    """Whether a law needs sub-steps: it depends on speed, position or time, or has a state."""
    effects = [model.library[name] for name, _ in model.effects]
    asks = {word for effect in effects if effect.category in ("force", "state") for item in effect.functions.values() for word in arguments(item)}
    return any(heeds_speed(effect) or effect.category in ("state", "friction", "bristle") for effect in effects) or bool({"x", "t", "v"} & asks)


def _filled(template: str, words: dict[str, str], parts: dict[str, list[str]]) -> list[str]:
    """The lines of a template; each line of a part gets the indentation of its name, and an empty part gives no line."""
    lines: list[str] = []
    for line in template.format(**words, **{name: f"\0{name}" for name in parts}).split("\n"):
        indent, _, name = line.partition("\0")
        lines += [indent + part for part in parts[name]] if name else [line]
    return lines


ROOM = TERMS  # numbers of ``w`` for each of the n
