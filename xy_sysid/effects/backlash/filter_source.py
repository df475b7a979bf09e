"""The source text of a filter across a gap, made from the laws of dry friction in the same model."""

from __future__ import annotations

from collections.abc import Sequence

from xy_sysid.effects._binding import call
from xy_sysid.effects._contract import Effect, arguments
from xy_sysid.effects.backlash.filter_parts import FLAT
from xy_sysid.effects.backlash.filter_template import TEMPLATE
from xy_sysid.errors import BadInput

NAMES = ("gain", "delay", "pole", "gap", "share", "rate", "damping", "loss", "guide", "hertz", "rub")  # followed by those of friction
SLOW = 1e-3  # m/s at which the smoothed friction reaches tanh(1) = 76 % of its level
FAST = FLAT * SLOW  # m/s above which smoothing has no effect
NUDGE = 1e-7  # m/s, for the derivative of a law by speed


def text(name: str, laws: Sequence[Effect]) -> str:
    """Source of ``name(u, y, against, q, fs, noise, drift, cuts, moved_u, moved_y, moved_f, column, nudge, out, slopes)``.

    One pass of the filter. u: (n,) V; y: (n + 1,) m; against: (2, n) V, forces at the motor and on the table, without delay;
    q: numbers by ``NAMES``, then the parameters of each law; fs: Hz; noise: variance of the encoder, m^2; drift: of the speeds,
    m^2/s^3; cuts: sub-steps of each of a sample's two pieces; out: (n,) receives measured minus predicted position, m.

    slopes: (n, columns) receives the derivatives of ``out`` by each number of ``q``, then by those of companions; (0, 0) for none.
    moved_u, moved_y, moved_f: derivatives of u, y, against by some numbers, (b, n), (b, n + 1), (b, 2, n), whose places in the
    columns are column (b,); nudge: (numbers of the laws,) steps for their derivatives.
    Raises BadInput for laws that cannot act together.
    """
    dry = [effect for effect in laws if effect.category == "friction"]
    bristles = [effect for effect in laws if effect.category == "bristle"]
    if len(bristles) > 1 or len(dry) + len(bristles) != len(laws):
        raise BadInput(
            "dry friction across a gap", ", ".join(effect.name for effect in laws), "laws of friction, and one of bristles at most", "Leave one out."
        )
    return TEMPLATE.substitute(
        name=name,
        level=" + ".join(_call(laws, effect, "level", {"v": "v", "direction": "direction"}) for effect in dry) or "0.0",
        force=_bristle(laws, bristles, "force"),
        bent=_bristle(laws, bristles, "bend"),
        rubbed=_lines(BRISTLED if bristles else _dry(dry) if dry else ["return 0.0, 0.0, 0.0"]),
        rubs=str(bool(laws)),
        bristled=str(bool(bristles)),
        first=str(len(NAMES)),
        slow=f"{SLOW!r}",
        nudge=f"{NUDGE!r}",
    )


BRISTLED = [
    "force = force_of(q, z, v)",
    "further = z + 1e-4 * abs(z) + 1e-12",
    f"return force, (force_of(q, z, v + {NUDGE!r}) - force) / {NUDGE!r}, (force_of(q, further, v) - force) / (further - z)",
]


def _dry(laws: Sequence[Effect]) -> list[str]:
    """Text of level times direction, smoothed at reversals by tanh(v / SLOW)."""
    words = {word for effect in laws for word in arguments(effect.functions["level"])}
    lines = [
        f"steep = math.exp(-2.0 * abs(v) / {SLOW!r}) if abs(v) < {FAST!r} else 0.0",
        "smooth = math.copysign((1.0 - steep) / (1.0 + steep), v)",
        "forth = level_of(q, v, 1.0)",
        "back = level_of(q, v, -1.0)" if "direction" in words else "back = forth",
        f"slip = 0.5 * (1.0 - smooth * smooth) / {SLOW!r} * (forth + back)",
    ]
    if "v" in words:
        faster = f"v + {NUDGE!r}"
        lines += [
            f"more = level_of(q, {faster}, 1.0) - forth",
            f"less = level_of(q, {faster}, -1.0) - back" if "direction" in words else "less = more",
            f"slip += 0.5 * ((1.0 + smooth) * more - (1.0 - smooth) * less) / {NUDGE!r}",
        ]
    return [*lines, "return 0.5 * ((1.0 + smooth) * forth - (1.0 - smooth) * back), slip, 0.0"]


def _bristle(laws: Sequence[Effect], bristles: Sequence[Effect], function: str) -> str:
    """Text of a law of bristles; without bristles, constant deflection and no force."""
    words = {"v": "v", "h": "h", "level": "level_of(q, v, math.copysign(1.0, v))"}
    return "".join(_call(laws, effect, function, words) for effect in bristles) or ("z" if function == "bend" else "0.0")


def _call(laws: Sequence[Effect], effect: Effect, function: str, words: dict[str, str]) -> str:
    first = len(NAMES) + sum(len(other.names) for other in laws[: laws.index(effect)])
    own = {name: f"q[{first + place}]" for place, name in enumerate(effect.names)}
    return call(effect, function, {**words, **own, **dict.fromkeys(effect.states, "z")})


def _lines(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)
