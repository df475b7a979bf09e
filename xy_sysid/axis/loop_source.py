"""Generates the source text of one simulation loop from the laws of a set of effects.

Every effect of the set is in the loop behind a flag, so that any combination runs without a new compilation. Terms that do
not depend on speed are computed before the loop, or once per piece of a sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from xy_sysid.axis.loop_template import TEMPLATE, UNDOING
from xy_sysid.axis.resonant_loop import CUTS, FINE, STIFF, TERMS
from xy_sysid.effects._binding import call
from xy_sysid.effects._contract import Effect, arguments

BASE = ("gain", "delay", "pole")
GAUSS = 3.0**-0.5  # of half a piece: the two evaluation points
SIDES = (("forth", "+", "1.0"), ("back", "-", "-1.0"))  # slope of a straight line: its value at 1 m/s
PLACED = 2  # iterations: if the error changes by 1 per cent of the motion, they determine it to 1e-4 of itself


def slots(effects: Sequence[Effect]) -> dict[str, int]:
    """Index of each parameter in the row of numbers: ``gain``, ``delay``, ``pole``, then ``effect.parameter``."""
    names = [*BASE, *(f"{effect.name}.{name}" for effect in effects for name in effect.names)]
    return {name: place for place, name in enumerate(names)}


def text(name: str, effects: Sequence[Effect]) -> str:
    """Source of ``name(u, x, p, on, fs, fine, start, out)``, which simulates the velocity.

    u: (n,) held voltage, V; x: (n + 1,) measured position, m; p: numbers in the order of ``slots``; on: (effects,) flags;
    fs: Hz; fine: Hz, sub-steps of laws that depend on speed; start: speed at the first sample, m/s;
    out: (n,) receives the mean velocity of each sample, m/s.
    """
    return _loop(name, effects, {"more": "", "begins": "", "ends": "", "places": _places(effects), "inputs": _inputs(effects)}, _encoders())


def moving(name: str, effects: Sequence[Effect]) -> str:
    """Source of ``name(u, x, p, on, fs, fine, start, out, centring, most, ago, sent)``: an axis whose position follows from its simulated motion.

    As ``text``, but x: (n + 1,) m, its first value is the start position, and the others receive the position of the axis; u: (n,) the wanted
    voltage, V; centring: (n,) V/m towards the start, for the position ``ago`` samples ago; most: V; sent: (n,) receives the applied voltage, V.
    """
    own = {
        "more": ", centring, most, ago, sent",
        "begins": _own_begins(effects),
        "ends": _own_ends(),
        "places": "    encoded = False",
        "inputs": "    pass",
    }
    return _loop(name, effects, own, _own_encoders(effects))


def _loop(name: str, effects: Sequence[Effect], how: Mapping[str, str], encoders: str) -> str:
    return TEMPLATE.substitute(
        how,
        name=name,
        stiff=f"{STIFF:.2f}",
        most=f"{CUTS}",
        terms=f"{TERMS}",
        gauss=f"{GAUSS:.12f}",
        unpack=_unpack(effects),
        flags=_flags(effects),
        levels=_levels(effects),
        loaded=_loaded(effects, 5),
        loaded_cut=_loaded(effects, 6),
        slopes=_slopes(effects),
        states=_states(effects),
        pulls=_pulls(effects),
        advance=_advance(effects),
        drag_start=_drags(effects, "v", 5),
        drag_middle=_drags(effects, "middle", 5),
        drag_free=_drags(effects, "middle", 6),
        level_start=_moving_levels(effects, "v"),
        level_middle=_moving_levels(effects, "middle"),
        bristle=_bristle(effects, hung=False),
        bristle_hung=_bristle(effects, hung=True),
        hang=_hang(effects),
        motions=_motions(effects),
        encoders=encoders,
    )


def undoing(name: str, effects: Sequence[Effect]) -> str:
    """Source of ``name(u, x, p, on, fs, held, where, against)``, which removes some effects from a recording.

    u, x, p, on, fs: as in ``text``; held: (n,) receives the voltage behind the amplifier, V; where: (n + 1,) the position of the
    axis before resonances and the scale's errors, m; against: (2, n) forces against the drive, at the motor and at the table, V.
    Returns the fraction of a sudden change of ``where`` that the encoder shows at once. Only for effects of ``undoable``.
    """
    return UNDOING.substitute(
        name=name,
        gauss=f"{GAUSS:.12f}",
        unpack=_unpack(effects),
        flags=_flags(effects),
        places=_places(effects),
        inputs=_inputs(effects),
        states=_states(effects),
        advance=_advance([effect for effect in effects if not heeds_speed(effect)], 2),
        pulls=_pulls([effect for effect in effects if not effect.on_table], 2),
        loads=_pulls([effect for effect in effects if effect.on_table], 2),
        motions=_motions_taken_back(effects),
    )


def undoable(effect: Effect) -> bool:
    """True if the effect depends on voltage, position and time only."""
    if effect.category == "motion":
        return effect.can_be_undone
    return effect.category in ("input", "encoder") or (effect.category in ("force", "state") and not heeds_speed(effect))


def bends(effect: Effect) -> bool:
    """True if the law is nonlinear in speed: then it needs sub-steps."""
    return needs_speed(effect) and not effect.straight


def needs_speed(effect: Effect) -> bool:
    """True if the law's value changes within a piece of a sample because the speed does."""
    if effect.category in ("state", "bristle"):
        return True
    return effect.category in ("force", "friction") and any("v" in arguments(item) for item in effect.functions.values())


def _asks_where(effect: Effect) -> bool:
    """True for a force or a state whose law depends on position or time."""
    return effect.category in ("force", "state") and any({"x", "t"} & set(arguments(item)) for item in effect.functions.values())


def heeds_speed(effect: Effect) -> bool:
    """True if the law depends on speed: then a resonance must be in the loop with it."""
    if effect.category in ("friction", "bristle"):
        return True
    return effect.category in ("force", "state") and any("v" in arguments(item) for item in effect.functions.values())


def _call(effect: Effect, function: str, words: Mapping[str, str]) -> str:
    own = {name: f"{effect.name}_{name}" for name in (*effect.names, *effect.states)}
    return call(effect, function, {**words, **own})


def _of(effects: Sequence[Effect], category: str) -> list[Effect]:
    return sorted((effect for effect in effects if effect.category == category), key=lambda effect: (effect.order, effect.name))


def _lines(depth: int, lines: Sequence[str]) -> str:
    return "\n".join("    " * depth + line for line in lines) or "    " * depth + "pass"


def _unpack(effects: Sequence[Effect]) -> str:
    place = slots(effects)
    return _lines(1, [f"{effect.name}_{name} = p[{place[f'{effect.name}.{name}']}]" for effect in effects for name in effect.names])


def _flags(effects: Sequence[Effect]) -> str:
    lines = [f"has_{effect.name} = on[{place}] != 0" for place, effect in enumerate(effects)]
    groups = {
        "heeded": [effect for effect in effects if heeds_speed(effect)],
        "curved": [effect for effect in effects if bends(effect)],
        "sloped": [effect for effect in effects if effect.straight],
        "any_state": _of(effects, "state"),
        "any_pull": [effect for effect in _of(effects, "force") if not needs_speed(effect)],
        "placed": [effect for effect in effects if _asks_where(effect)],
        "dry": _of(effects, "friction"),
        "loaded": [effect for effect in effects if effect.is_of_the_input],
        "bristled": _of(effects, "bristle"),
    }
    lines += [f"inside_{effect.name} = False" for effect in _of(effects, "motion")]
    lines += [f"{group} = {' or '.join(f'has_{effect.name}' for effect in members) or 'False'}" for group, members in groups.items()]
    return _lines(1, lines)


def _inputs(effects: Sequence[Effect]) -> str:
    words = {"u": "held[i]", "t": "i / fs", "x": "x[i]"}
    lines = []
    for effect in _of(effects, "input"):
        lines += [f"if has_{effect.name}:", "    for i in range(n):", f"        held[i] = {_call(effect, 'output', words)}"]
    return _lines(1, lines)


def _levels(effects: Sequence[Effect]) -> str:
    """Friction levels at rest, in both directions, and their part that does not depend on speed; without levels that depend on the voltage."""
    return _lines(1, [line for effect in _of(effects, "friction") if not effect.is_of_the_input for line in _added(effect, {})])


def _loaded(effects: Sequence[Effect], depth: int) -> str:
    """The same levels under the present voltage, with those that depend on it."""
    lines = ["fixed_forth, fixed_back, rest_forth, rest_back = unloaded"]
    for effect in _of(effects, "friction"):
        lines += _added(effect, {"u": "drive"}) if effect.is_of_the_input else []
    return _lines(depth, lines)


def _added(effect: Effect, words: Mapping[str, str]) -> list[str]:
    lines = [f"if has_{effect.name}:"]
    for side, direction in (("forth", "1.0"), ("back", "-1.0")):
        value = _call(effect, "level", {**words, "v": "0.0", "direction": direction})
        lines.append(f"    rest_{side} += {value}")
        if not needs_speed(effect):
            lines.append(f"    fixed_{side} += {value}")
    return lines


def _slopes(effects: Sequence[Effect]) -> str:
    """Slopes over speed, in both directions, of forces that are linear in speed, V s/m."""
    words = {"gain": "gain", "pole": "pole"}
    lines = []
    for effect in effects:
        if effect.straight:
            lines.append(f"if has_{effect.name}:")
            lines += [f"    slope_{side} {sign}= {_call(effect, 'force', {**words, 'v': v})}" for side, sign, v in SIDES]
    return _lines(1, lines)


def _states(effects: Sequence[Effect]) -> str:
    return _lines(1, [f"{effect.name}_{state} = 0.0" for effect in effects for state in effect.states])


def _pulls(effects: Sequence[Effect], depth: int = 5) -> str:
    """Mean of each force over the piece: at its middle in time, or at two positions if the law depends on position (Gauss's rule)."""
    words = {"x": "place", "t": "time", "u": "volts", "gain": "gain", "pole": "pole"}
    lines = []
    for effect in _of(effects, "force"):
        if needs_speed(effect):
            continue
        lines.append(f"if has_{effect.name}:")
        if "x" in arguments(effect.functions["force"]):
            pair = [_call(effect, "force", {**words, "x": place}) for place in ("near", "far")]
            lines.append(f"    pull += 0.5 * ({pair[0]} + {pair[1]})")
        else:
            lines.append(f"    pull += {_call(effect, 'force', words)}")
    return _lines(depth, lines)


def _advance(effects: Sequence[Effect], depth: int = 6) -> str:
    words = {"u": "drive", "v": "v", "x": "place", "t": "time", "h": "h", "gain": "gain", "pole": "pole"}
    lines = []
    for effect in _of(effects, "state"):
        targets = ", ".join(["drive", *(f"{effect.name}_{state}" for state in effect.states)])
        lines += [f"if has_{effect.name}:", f"    {targets} = {_call(effect, 'advance', words)}"]
    return _lines(depth, lines)


def _drags(effects: Sequence[Effect], speed: str, depth: int) -> str:
    words = {"u": "drive", "v": speed, "x": "place", "t": "time", "gain": "gain", "pole": "pole"}
    lines = []
    for effect in _of(effects, "force"):
        if needs_speed(effect):
            lines += [f"if has_{effect.name}:", f"    drag += {_call(effect, 'force', words)}"]
    return _lines(depth, lines)


def _moving_levels(effects: Sequence[Effect], speed: str) -> str:
    words = {"u": "drive", "v": speed, "direction": "direction"}
    lines = []
    for effect in _of(effects, "friction"):
        if needs_speed(effect):
            lines += [f"if has_{effect.name}:", f"    level += {_call(effect, 'level', words)}"]
    return _lines(5, lines)


def _bristle(effects: Sequence[Effect], hung: bool) -> str:
    """Half a step of bristle deflection, the force for the full step, the other half step; each uses the mean speed of its half.

    hung: with resonances in the loop
    """

    def words(speed: str) -> dict[str, str]:
        return {"v": speed, "h": "0.5 * h", "level": "level"}

    begins, bends, forces, relaxes = [], [], [], []
    for effect in _of(effects, "bristle"):
        state, flag = f"{effect.name}_{effect.states[0]}", f"if has_{effect.name}:"
        begins += [flag, f"    first -= turn * {_call(effect, 'force', words('v'))}"]
        bends += [flag, f"    {state} = {_call(effect, 'bend', words('0.5 * (v + middle)'))}"]
        forces += [flag, f"    push -= turn * {_call(effect, 'force', words('middle'))}"]
        relaxes += [flag, f"    {state} = {_call(effect, 'bend', words('0.5 * (middle + end)'))}"]
    if hung:
        half = "middle = 0.5 * (v + ahead(moving, piece, swung, first))"
        move = ["moved += step(moving, piece, swung, push, spare)", "end = swung[1]"]
    else:
        half = "middle = v + 0.5 * (gain * first - v) * (1.0 - decay)"
        move = ["reach = gain * push", "end = reach + (v - reach) * decay", "moved += reach * h + (v - reach) * spent"]
    return _lines(6, ["turn = math.copysign(1.0, gain)", "first = push", *begins, half, *bends, *forces, *move, *relaxes, "v = end"])


def _hang(effects: Sequence[Effect]) -> str:
    """The resonances as polynomials with gain 1 at 0 Hz; a section without roots in s filters the sampled motion instead."""
    lines = []
    for effect in _of(effects, "motion"):
        lines += [
            f"if has_{effect.name}:",
            f"    b0, b1, b2, a1, a2 = {_call(effect, 'section', {'fs': f'{FINE:.1f}'})}",
            "    z0, z1 = roots(b1 / b0, b2 / b0, fs)",
            "    p0, p1 = roots(a1, a2, fs)",
            "    if z0 > 0.0 and p0 > 0.0 and abs((b0 + b1 + b2) / (1.0 + a1 + a2) - 1.0) < 1e-4:",
            f"        hung = inside_{effect.name} = True",
            "        top, bottom = times(top, np.array([z0, z1, 1.0])), times(bottom, np.array([p0, p1, 1.0]))",
        ]
    return _lines(1, lines)


def _motions(effects: Sequence[Effect]) -> str:
    lines = []
    for effect in _of(effects, "motion"):
        lines += [
            f"if has_{effect.name} and not inside_{effect.name}:",
            f"    b0, b1, b2, a1, a2 = {_call(effect, 'section', {'fs': 'fs'})}",
            "    steady = (b0 + b1 + b2) / (1.0 + a1 + a2) * start",
            "    first, second = steady - b0 * start, b2 * start - a2 * steady",
            "    for i in range(n):",
            "        value = b0 * out[i] + first",
            "        first = b1 * out[i] - a1 * value + second",
            "        second = b2 * out[i] - a2 * value",
            "        out[i] = value",
        ]
    return _lines(1, lines)


def _motions_taken_back(effects: Sequence[Effect]) -> str:
    """The inverse of the same sections: their zeros are damped, so the inverse is stable."""
    lines = []
    for effect in _of(effects, "motion"):
        lines += [
            f"if has_{effect.name}:",
            f"    b0, b1, b2, a1, a2 = {_call(effect, 'section', {'fs': 'fs'})}",
            "    through *= b0",
            "    first = second = 0.0",
            "    before = where[0]",
            "    for i in range(n):",
            "        seen = where[i + 1] - before",
            "        before = where[i + 1]",
            "        value = (seen - first) / b0",
            "        first = b1 * value - a1 * seen + second",
            "        second = b2 * value - a2 * seen",
            "        where[i + 1] = where[i] + value",
        ]
    return _lines(1, lines)


def _places(effects: Sequence[Effect]) -> str:
    """The axis position by iteration: x = shown - (error(x) - error(0)), so that both are 0 at the same position."""
    lines = ["shown, encoded, offset = x, False, 0.0"]
    for effect in _of(effects, "encoder"):
        lines += [f"if has_{effect.name}:", "    encoded = True", f"    offset += {_call(effect, 'error', {'x': '0.0'})}"]
    lines += [
        "if encoded:",
        "    x = shown.copy()",
        "    for i in range(n + 1):",
        f"        for _ in range({PLACED}):",
        "            wrong = -offset",
    ]
    for effect in _of(effects, "encoder"):
        lines += [f"            if has_{effect.name}:", f"                wrong += {_call(effect, 'error', {'x': 'x[i]'})}"]
    return _lines(1, [*lines, "            x[i] = shown[i] - wrong"])


def _encoders() -> str:
    return _lines(1, ["if encoded:", "    for i in range(n):", "        out[i] += ((shown[i + 1] - x[i + 1]) - (shown[i] - x[i])) * fs"])


def _own_begins(effects: Sequence[Effect]) -> str:
    """Start of a sample: its voltage, and the position at its end predicted with the previous sample's speed."""
    lines = ["asked = u[i] + centring[i] * (x[0] - x[max(i - ago, 0)])", "sent[i] = held[i] = min(max(asked, -most), most)"]
    words = {"u": "held[i]", "t": "i / fs", "x": "x[i]"}
    for effect in _of(effects, "input"):
        lines += [f"if has_{effect.name}:", f"    held[i] = {_call(effect, 'output', words)}"]
    lines += ["last = out[i - 1] / fs if i > 0 else start / fs", "x[i + 1] = x[i] + last", "if i + 2 <= n:", "    x[i + 2] = x[i + 1] + last"]
    return "\n" + _lines(3, lines)


def _own_ends() -> str:
    return "\n" + _lines(3, ["x[i + 1] = x[i] + out[i] / fs"])


def _own_encoders(effects: Sequence[Effect]) -> str:
    """The encoder's reading from the motion; the position is known."""
    lines = []
    for effect in _of(effects, "encoder"):
        ends = [_call(effect, "error", {"x": place}) for place in ("x[i + 1]", "x[i]")]
        lines += [f"if has_{effect.name}:", "    for i in range(n):", f"        out[i] += ({ends[0]} - {ends[1]}) * fs"]
    return _lines(1, lines)
