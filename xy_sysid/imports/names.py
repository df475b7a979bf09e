"""The meaning of a column's name: ``Motor Voltage (V)`` is an input, ``time_ms`` the time, ``u_x`` the input of the axis x.

Only the words in the tables below are known; for other names use ``--map``.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Container
from dataclasses import dataclass

from xy_sysid.imports.foreign_units import DRIVES, FOLDED, KNOWN, MOTIONS, POSITIONS, Quantity, unit_of
from xy_sysid.imports.sheet import spoken

HEADER = re.compile(r"^\s*(?P<name>.*?)\s*(?:[\[\(]\s*(?P<unit>[^\]\)]*?)\s*[\]\)])?\s*$")
TIME = "time t zeit zeitstempel uhrzeit timestamp stamp tijd temps tiempo tempo clock elapsed seconds"
INPUTS: tuple[tuple[Quantity, str], ...] = (
    ("voltage", "voltage volt volts spannung spanning u uin vin"),
    ("command", "input inp command cmd control ctrl duty pwm drive stellgrosse stellgroesse"),
    ("current", "current curr amps iq strom stroom"),
    ("torque", "torque moment drehmoment tau"),
    ("force", "force kraft kracht"),
    ("unknown", "effort"),
)
OUTPUTS: tuple[tuple[Quantity, str], ...] = (
    ("position", "position pos posi positie posizione posicion lage weg angle winkel hoek theta phi encoder enc displacement output out y q"),
    ("velocity", "velocity vel speed geschwindigkeit drehzahl snelheid omega"),
    ("acceleration", "acceleration accel acc beschleunigung versnelling"),
)
REFERENCE = "reference ref set setpoint target desired des demand demanded commanded soll sollwert r"
ASKED = ("command", "cmd", *REFERENCE.split())
OTHER = "error err fehler noise status state temperature temp bus supply limit diff id index flag mode sigma unit"
FILLERS = (
    "motor servo actual act measured meas ist value val signal sig raw filtered data feedback fb fbk "
    "joint joints states the axis achse in of root model"
)
ANGLES = "angle winkel hoek theta phi omega drehzahl q"  # q: of a robot's joint
LETTERS = ("t", "u", "y", "r", "q")  # a word has priority over a role of one letter: y_position is of the axis y
QUADRATURE = re.compile(r"(?<![a-zA-Z])[iI]_[qQ](?![a-zA-Z])")
SOLL = re.compile(r"(?i)soll(wert)?")
SYMBOLS = {"V": "input", "F": "input", "I": "input", "i": "input", "x": "output"}  # symbols of physics: used if no other column has the role
RATE = re.compile(r"[\s_.\-](?P<of>(?!in[_/])[a-zA-Z]+)[_/]s(?P<twice>\^?2)?$")  # mm_s, deg/s, rad_s2, but not time_in_s
LONG = 5  # least letters of a word that is found inside a longer one: motorvoltage


USUAL: dict[Quantity, str] = {"voltage": "V", "command": "V", "current": "A", "torque": "N m", "force": "N", "unknown": "effort"}
MOVED: dict[Quantity, tuple[str, str]] = {"position": ("m", "rad"), "velocity": ("m/s", "rad/s"), "acceleration": ("m/s^2", "rad/s^2")}


@dataclass(frozen=True, slots=True)
class Meaning:
    """The meaning of a name. role: one of ``reading.ROLES``; quantity: that is measured; rank: the smaller, the more likely."""

    role: str
    quantity: Quantity
    axis: str
    unit: str
    rank: int


def header(cell: str) -> tuple[str, str]:
    """Name and unit of a header like ``x_position[mm]``; brackets around a number, or around a remark after a unit, belong to the name."""
    found = HEADER.match(cell)
    if found is None or not found["unit"] or (found["unit"].isdigit() and found["unit"] != "1"):
        return cell.strip(), ""
    name, unit = found["name"].strip(), found["unit"]
    if unit_of(unit).quantity == "unknown":
        inner, before = header(name)
        if unit_of(before).quantity != "unknown" and before != "1":
            return f"{inner} ({unit})", before
    return name, unit


def meaning(name: str, unit: str) -> Meaning | None:
    """The meaning of a name and a unit; None if they have none."""
    words = _words(name)
    unit, words = _unit(name, unit, words)
    if any(word in OTHER.split() for word in words):
        return None
    hits = [(place, *hit) for place, word in enumerate(words) for hit in _hits(word)]
    if any(words[place] not in LETTERS for place, *_ in hits):
        hits = [hit for hit in hits if words[hit[0]] not in LETTERS]
    elif len(hits) > 1:  # letters alone: u_y is u of y, x_y is y of x, y_y is y of y
        hits = [next((hit for hit in hits if words[hit[0]] in ("u", "t", "r")), hits[-1])]
    if not hits:
        return None
    rest = [word for place, word in enumerate(words) if place not in {hit[0] for hit in hits} and word not in FILLERS.split()]
    asked = any(words[place] in ASKED for place, *_ in hits)
    roles = {role for _, role, *_ in hits}
    _, role, quantity, rank = next((hit for hit in reversed(hits) if hit[1] in ("input", "output") and words[hit[0]] not in ASKED), hits[-1])
    if role == "output" and asked:
        role = "reference"
    elif "time" in roles and len(roles) > 1:
        return None
    measured = unit_of(unit).quantity if unit else "unknown"
    fitting = MOVED if role in ("output", "reference") else USUAL
    if measured in fitting and measured != "unknown":
        quantity = measured
    later = asked and role == "input" and quantity != "command"  # a measured input is more likely than a commanded one
    return Meaning(role=role, quantity=quantity, axis="_".join(rest), unit=unit, rank=2 * rank + later)


def by_unit(name: str, unit: str) -> str:
    """The role of a column whose name has no meaning, by its unit or as a symbol of physics: input, output, or empty."""
    if any(word in OTHER.split() for word in spoken(name)):
        return ""
    quantity = unit_of(unit).quantity if unit else "unknown"
    return SYMBOLS.get(name, "") if quantity == "unknown" else "input" if quantity in DRIVES else "output" if quantity in MOTIONS else ""


def tells_time(name: str) -> bool:
    """Whether a word of a name means the time; single letters do not count."""
    return any(word in TIME.split() and word not in LETTERS for word in spoken(name))


def _words(name: str) -> list[str]:
    """The words of a name, in lower case, with numbers and soll (German: commanded) separated, and i_q (current) as one word."""
    return [piece for word in spoken(SOLL.sub(r" \g<0> ", QUADRATURE.sub("iq", name))) for piece in _pieces(word)]


def _pieces(word: str) -> list[str]:
    """A word that is split from its number if it has a role: u and 1, but joint1."""
    found = re.fullmatch(r"(\D+)(\d+)", word)
    return [found[1], found[2]] if found and _hits(found[1]) else [word]


def _hits(word: str) -> list[tuple[str, Quantity, int]]:
    """(role, quantity, rank) that a word may mean, with or without accents."""
    word = "".join(sign for sign in unicodedata.normalize("NFKD", word) if not unicodedata.combining(sign))
    if word in TIME.split():
        return [("time", "time", 0)]
    if word in REFERENCE.split():
        return [("reference", "position", 0)]
    for exact in (True, False):
        for role, table in (("input", INPUTS), ("output", OUTPUTS)):
            for rank, (quantity, names) in enumerate(table):
                if any(word == one or (not exact and len(one) >= LONG and one in word) for one in names.split()):
                    return [(role, quantity, rank)]
    return []


def _unit(name: str, unit: str, words: list[str]) -> tuple[str, list[str]]:
    """The unit, and the words without it: a unit at the end of a name (time_ms, pos_mm, vel_deg_s) if it fits the words before it."""
    rate = "" if unit else rate_at_end(name)
    if rate and any(role in ("output", "reference") or quantity == "command" for word in words[:-2] for role, quantity, _ in _hits(word)):
        return rate, words[:-2]
    last = re.split(r"[\s_.\-/]+", name.strip())[-1]
    if unit or len(words) < 2 or words[-1] != last.casefold():
        return unit, words
    before = [hit for word in words[:-1] for hit in _hits(word)]
    spellings = [last, *FOLDED.get(last.casefold(), [])] if len(last) > 1 else [last]  # a single letter may be an axis
    for spelling in spellings:
        fits = KNOWN[spelling].quantity if spelling in KNOWN else "unknown"
        drives = {"command": fits != "time", "unknown": fits in DRIVES}  # an effort is a drive signal of unknown quantity
        if fits != "unknown" and any(quantity == fits or (role == "input" and drives.get(quantity, False)) for role, quantity, _ in before):
            return spelling, words[:-1]
    return unit, words


def rate_at_end(name: str) -> str:
    """deg/s for speed_deg_s, mm/s^2 for acc_mm_s2; empty for other names."""
    found = RATE.search(name)
    return f"{found['of']}/s{'^2' if found['twice'] else ''}" if found is not None and found["of"] in POSITIONS else ""


def unit_at_end(name: str, quantities: Container[Quantity]) -> str:
    """The unit at the end of a name without other meaning, if it is of one of these quantities: deg for feedback_deg."""
    last = re.split(r"[\s_.\-]+", name.strip())[-1]
    rate = rate_at_end(name)
    if rate and unit_of(rate).quantity in quantities:
        return rate
    return last if 1 < len(last) < len(name.strip()) and last in KNOWN and KNOWN[last].quantity in quantities else ""


def usual_unit(name: str, found: Meaning) -> str:
    """The unit of a column that names none; duty and pwm are fractions of full scale."""
    words = _words(name)
    if found.quantity in MOVED:
        return MOVED[found.quantity][any(word in ANGLES.split() for word in words)]
    return "FS" if any(word in ("duty", "pwm") for word in words) else USUAL.get(found.quantity, "s")
