"""The text of one sample of the feedforward: the voltage that moves an axis model along a path.

Encoder, resonances, base, friction, forces, lag and amplifier are inverted in this order, against the signal path. The attached masses follow
the path's speed, so a resonance is inverted without differentiation. As in ``step_text``, one text is compiled here and printed in other languages.
"""

from __future__ import annotations

from string import Template

from xy_sysid.control_design.law_text import LawText, indented
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import arguments

NUDGE = 1e-6  # m: step for differentiating the encoder's error
PASSES = 4  # iterations for a force that depends on the unknown voltage
TRIES = 40  # iterations for an amplifier's law: enough to leave a dead zone of any width; and for friction that takes a large part of the voltage

TEMPLATE = Template("""\
def $name($signature):
    x = r
$encoder
    s[0] = x
    s[1] = v
    effort = acc
    for j in range(1, $n - 1):
        effort -= moving[$n + j] * s[j]
    effort = effort / moving[$n + $n - 1]
    for _ in range($cuts):
        unfold(guided, $n, s, acc, w)
        follow($n, w, h / $cuts, s)
    s[0] = x
    s[1] = v
    direction = 0.0
    if v > 0.0 or (v == 0.0 and acc > 0.0):
        direction = 1.0
    if v < 0.0 or (v == 0.0 and acc < 0.0):
        direction = -1.0
$friction
    total = effort
$forces
$lag
$inputs
    return total
""")


class InverseText(LawText):
    """Writes the feedforward."""

    def text(self, name: str) -> str:
        """Source of ``name(r, v, acc, h, cuts, p, on, z, moving, guided, s, w)``, V; of one model without ``p, on, z``.

        r, v, acc: position, speed and acceleration wanted; h: a sample, s; cuts: parts of it, so short that the series holds;
        guided: the generator of the masses attached to an axis with prescribed acceleration; s: a state with the layout of the simulation's
        """
        n = self.numbers["n"]
        return TEMPLATE.substitute(
            name=name,
            signature="r, v, acc, h, cuts, p, on, z, moving, guided, s, w" if self.guarded else "r, v, acc, h, cuts, moving, guided, s, w",
            n=n,
            cuts="cuts",
            encoder=indented(1, self._encoder()),
            friction=indented(1, self._friction()),
            forces=indented(1, self._forces()),
            lag=indented(1, self._lag()),
            inputs=indented(1, self._inputs()),
        )

    def _encoder(self) -> list[str]:
        effects = self.of("encoder")
        if not effects:
            return []

        def error(place: str) -> list[str]:
            lines = ["wrong = 0.0"]
            for effect in effects:
                at, zero = (self.call(effect, "error", {"x": where}) for where in (place, "0.0"))
                lines += self.guard(effect, [f"wrong += {at} - {zero}"])
            return lines

        lines: list[str] = []
        for _ in range(3):
            lines += [*error("x"), "x = r - wrong"]
        for place, kept in ((f"x + {NUDGE}", "ahead"), (f"x - {NUDGE}", "behind"), ("x", "here")):
            lines += [*error(place), f"{kept} = wrong"]
        lines.append(f"slope = 1.0 + (ahead - behind) / {2.0 * NUDGE}")
        lines.append("v = v / slope")
        lines.append(f"acc = (acc - (ahead - 2.0 * here + behind) / {NUDGE * NUDGE} * v * v) / slope")
        return lines

    def _friction(self) -> list[str]:
        """Friction levels; bristles, if there are any, use them and have a state. Levels that depend on the unknown voltage are among the forces."""
        turn = self.numbers["turn"]
        lines = ["level = 0.0"]
        for effect in self.of("friction"):
            if not effect.is_of_the_input:
                lines += self.guard(effect, [f"level += {self.call(effect, 'level', {'v': 'v', 'direction': 'direction'})}"])
        rubbing = f"effort += {turn} * direction * level"
        bristled: list[str] = []
        for effect in self.of("bristle"):
            state = f"s[{self.layout.state(effect, effect.states[0])}]"
            words = {"v": "v", "h": "h", "level": "level"}
            bent = [f"{state} = {self.call(effect, 'bend', words)}"]
            if self.guarded:
                bent = self._shaken(effect, state, bent)
            bristled += self.guard(effect, [*bent, f"effort += {turn} * {self.call(effect, 'force', words)}"])
        if not self.of("bristle"):
            return [*lines, rubbing]
        return [*lines, f"if not ({self.acts(self.of('bristle'))}):", f"    {rubbing}", *bristled] if self.guarded else [*lines, *bristled]

    def _shaken(self, effect: Effect, state: str, calm: list[str]) -> list[str]:
        """Noise moves the axis back and forth at rest, and this relaxes the bristles: half a sample in each direction."""
        shake = self.numbers["shake"]
        halves = [f"{state} = {self.call(effect, 'bend', {'v': f'(v {way} {shake})', 'h': '0.5 * h', 'level': 'level'})}" for way in ("+", "-")]
        return [f"if {shake} > 0.0:", *("    " + line for line in halves), "else:", *("    " + line for line in calm)]

    def _forces(self) -> list[str]:
        """Forces, added once; iterated if one depends on the voltage itself, and longer if it is friction."""
        rubbing = [effect for effect in self.of("friction") if effect.is_of_the_input]
        if not self.of("force") and not rubbing:
            return []
        lines: list[str] = ["pull = 0.0"]
        for effect in self.of("force"):
            words = {"u": "total", "v": "v", "x": "x", "t": "0.0"}
            lines += self.guard(effect, [f"pull += {self.call(effect, 'force', words)}"])
        for effect in rubbing:
            words = {"u": "total", "v": "v", "direction": "direction"}
            lines += self.guard(effect, [f"pull += {self.numbers['turn']} * direction * {self.call(effect, 'level', words)}"])
        lines.append("total = effort + pull")
        if not rubbing and not any("u" in arguments(effect.functions["force"]) for effect in self.of("force")):
            return lines
        passes = [f"passes = {TRIES if rubbing and not self.guarded else PASSES}"]
        passes += [line for effect in rubbing if self.guarded for line in self.guard(effect, [f"passes = {TRIES}"])]
        return [*passes, "for _ in range(passes):", *("    " + line for line in lines)]

    def _lag(self) -> list[str]:
        """Inverse of a first-order lag: adds its time constant times the rate of change."""
        lines: list[str] = []
        for effect in self.of("state"):
            if len(effect.states) == 1:
                old = f"s[{self.layout.state(effect, effect.states[0])}]"
                words = {"u": "1.0", effect.states[0]: "0.0", "v": "0.0", "x": "0.0", "t": "0.0", "h": "h"}
                given = [f"mean, gained = {self.call(effect, 'advance', words)}", f"later = total + (total - {old}) * (1.0 - gained) / gained"]
                lines += self.guard(effect, [*given, f"{old} = total", "total = later"])
        return lines

    def _inputs(self) -> list[str]:
        """Iterate the amplifier's input until its output matches the wanted value; values outside its range are not requested."""
        if not self.of("input"):
            return []
        lines = ["held = total"]
        for effect in self.of("input"):
            lines += self.guard(effect, [f"held = {self.call(effect, 'output', {'u': 'held', 't': '0.0', 'x': 'x'})}"])
        tried = [*lines, "total = total + (wanted - held)"]
        last = [*lines, "if abs(held - wanted) > 1e-6 * abs(wanted):", "    total = held"]
        return ["wanted = total", f"for _ in range({TRIES}):", *("    " + line for line in tried), *last]
