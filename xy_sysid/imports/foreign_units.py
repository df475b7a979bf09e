"""Units of other programs' files: the quantity of a column, and its factor to SI. An unknown unit is kept and reported."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from xy_sysid.samples.block import FloatArray

Quantity = Literal["time", "voltage", "current", "force", "torque", "command", "position", "velocity", "acceleration", "unknown"]
FULL_SCALE = "FS"  # of a normalised command: 1 is the full output of the drive
COUNTS = "counts"
DRIVES: tuple[Quantity, ...] = ("voltage", "current", "force", "torque", "command")
MOTIONS: tuple[Quantity, ...] = ("position", "velocity", "acceleration")


@dataclass(frozen=True, slots=True)
class Unit:
    """name: in SI, or as written if unknown; scale: SI = number * scale; guessed: from another spelling (MM for mm)."""

    name: str
    scale: float
    quantity: Quantity
    guessed: bool = False


def _spellings(quantity: Quantity, name: str, scales: dict[str, float]) -> dict[str, Unit]:
    return {spelling: Unit(name, scale, quantity) for spellings, scale in scales.items() for spelling in spellings.split()}


TURN = 2 * np.pi
LENGTHS = {"m meter metre meters metres": 1.0, "cm": 1e-2, "mm millimeter millimetre millimeters millimetres": 1e-3, "um micron microns": 1e-6}
LENGTHS |= {"nm": 1e-9, "in inch inches": 0.0254, "ft foot feet": 0.3048, "km": 1e3}
ANGLES = {
    "rad radian radians": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg degree degrees °": np.pi / 180,
    "rev turn turns revolution revolutions": TURN,
}
TIMES = {"s sec secs second seconds": 1.0, "ms msec millis millisecond milliseconds": 1e-3, "us usec micros microsecond microseconds": 1e-6}
TIMES |= {"ns nsec nanos nanosecond nanoseconds": 1e-9, "min minute minutes": 60.0, "h hour hours": 3600.0}
COUNTED = {"counts count cts cnt ticks tick inc incs increments pulses steps lsb": 1.0}
POSITIONS = _spellings("position", "m", LENGTHS) | _spellings("position", "rad", ANGLES) | _spellings("position", COUNTS, COUNTED)
KNOWN: dict[str, Unit] = {
    **_spellings("time", "s", TIMES),
    **_spellings("voltage", "V", {"V volt volts": 1.0, "mV": 1e-3, "kV": 1e3, "uV": 1e-6}),
    **_spellings("current", "A", {"A amp amps ampere amperes Arms": 1.0, "mA": 1e-3, "uA": 1e-6}),
    **_spellings("force", "N", {"N newton newtons": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605}),
    **_spellings("torque", "N m", {"Nm": 1.0, "mNm Nmm": 1e-3, "Ncm": 1e-2, "kNm": 1e3}),
    **_spellings("command", FULL_SCALE, {"FS 1 - pu norm normalised normalized duty": 1.0, "% percent": 0.01, "‰ permille": 1e-3}),
    **_spellings("velocity", "rad/s", {"rpm r/min U/min 1/min /min": TURN / 60, "krpm": TURN / 0.06, "rps r/s U/s": TURN, "dps": TURN / 360}),
    **_spellings("velocity", "m/s", {"mps": 1.0, "km/h kph": 1 / 3.6}),
    **_spellings("acceleration", "m/s^2", {"g": 9.80665}),
    **POSITIONS,
}
FOLDED: dict[str, list[str]] = {}
for _spelling in KNOWN:
    FOLDED.setdefault(_spelling.casefold(), []).append(_spelling)
INVERSE = re.compile(r"[\s·*.]*(?<![A-Za-z])(?P<time>s|sec|min)\^?-(?P<power>[12])$")  # rad s^-1, min-1
PER_TIME = re.compile(r"^(?P<of>.+?)/(?P<time>[a-zA-Z]+?)(?P<twice>\^?2|\*\*2|/s)?$")


def unit_of(text: str) -> Unit:
    """The meaning of a unit; "unknown" for one that is not in the table, which is kept unchanged."""
    plain = text.strip().replace("µ", "u").replace("μ", "u").replace("²", "^2").replace("⁻", "^-").replace("¹", "1").replace("^-^", "^-")
    plain = INVERSE.sub(lambda found: f"/{found['time']}{'^2' if found['power'] == '2' else ''}", plain)
    key = re.sub(r"\s+|(?<=[A-Za-z])[·*.-](?=[A-Za-z])", "", plain)
    if key in KNOWN:
        return KNOWN[key]
    rate = PER_TIME.match(key)
    if rate is not None and rate["time"].casefold() in KNOWN and KNOWN[rate["time"].casefold()].quantity == "time":
        of, per = unit_of(rate["of"]), KNOWN[rate["time"].casefold()].scale
        if of.quantity == "position":
            twice = rate["twice"] is not None
            return Unit(
                f"{of.name}/s{'^2' if twice else ''}", of.scale / per ** (2 if twice else 1), "acceleration" if twice else "velocity", of.guessed
            )
    near = FOLDED.get(key.casefold(), [])
    if len({(KNOWN[one].name, KNOWN[one].scale) for one in near}) == 1:
        known = KNOWN[near[0]]
        return Unit(known.name, known.scale, known.quantity, guessed=True)
    return Unit(text.strip(), 1.0, "unknown")


def to_si(values: FloatArray, text: str, what: str, notes: list[str]) -> tuple[FloatArray, Unit]:
    """Values in SI and their unit; a note reports a conversion, a guess or an unknown unit."""
    unit = unit_of(text)
    if unit.quantity == "unknown":
        notes.append(f"the unit {text!r} of {what} is not known; it is kept as it is (give another with --unit, or a factor with --scale)")
        return values, unit
    if unit.name.startswith(COUNTS):
        notes.append(f"{what} is in {unit.name}, which is not a length: give its size in m with --scale")
    if unit.guessed:
        meant = FOLDED[text.strip().casefold()][0] if text.strip().casefold() in FOLDED else unit.name
        notes.append(f"the unit {text!r} of {what} is taken as {meant}")
    if unit.scale == 1.0:
        return values, unit
    notes.append(f"{what} is converted from {text} to {unit.name}")
    return values * unit.scale, unit
