"""Units: what foreign ones are in SI, and those of an axis, which go with its data to wherever words are made.

The models write V for whatever drives an axis and m for whatever it moves by; ``Units.of`` says what that is of this axis.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal, NamedTuple

SCALES = {
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "kV": ("V", 1e3),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
    "μm": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "in": ("m", 0.0254),
    "inch": ("m", 0.0254),
    "mA": ("A", 1e-3),
    "deg": ("rad", math.pi / 180),
    "mrad": ("rad", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "µs": ("s", 1e-6),
    "μs": ("s", 1e-6),
    "ns": ("s", 1e-9),
}
MOVED = ("m", "rad")  # motion is read in thousandths of these
CHOICES = {  # what a reader may choose for each of them, the usual one first, with its factor; rpm is rev for an angle
    "m": {"mm": 1e3, "um": 1e6, "m": 1.0, "in": 1 / 0.0254},
    "rad": {"mrad": 1e3, "rad": 1.0, "deg": 180 / math.pi, "rpm": 30 / math.pi},
}
_CHOSEN: ContextVar[tuple[str, ...]] = ContextVar("chosen units", default=())

BEYOND_REASON = 1e6  # times, sigma or per cent: larger values are shown as this one


def told(value: float, digits: int = 3) -> str:
    """How many times, sigma or per cent, for people; what is beyond reason is not counted."""
    if math.isnan(value):
        return "-"
    if abs(value) >= BEYOND_REASON:
        return f"{'over' if value > 0 else 'below'} {math.copysign(BEYOND_REASON, value):.0e}"
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text else text


Sensed = Literal["position", "velocity", "acceleration"]
PER_TIME: dict[Sensed, str] = {"position": "", "velocity": "/s", "acceleration": "/s^2"}


class Units(NamedTuple):
    """What the input and the output of an axis are counted in; output: the position, also where a velocity or an acceleration was measured."""

    input: str = "V"
    output: str = "m"

    @property
    def sensed(self) -> Sensed:
        """What the sensor of the output measures."""
        return "position"

    @property
    def speed(self) -> str:
        """Of the output's velocity."""
        return f"{self.output}/s"

    @property
    def measured(self) -> str:
        """Of the output as its sensor reads it."""
        return f"{self.output}{PER_TIME[self.sensed]}"

    @property
    def judged(self) -> str:
        """Of the errors by which a model is judged: the acceleration where that was measured, otherwise the velocity."""
        return f"{self.output}/s^2" if self.sensed == "acceleration" else self.speed

    def of(self, unit: str) -> str:
        """A unit of the models for this axis: m/s/V becomes rad/s/(N m), V/m3 becomes N m/rad3."""

        def named(found: re.Match[str]) -> str:
            name = self.input if found[2] == "V" else self.output
            return over("", name) if found[1] else name

        return MODEL_UNIT.sub(named, unit)


class OfVelocity(Units):
    """Where the output's velocity was measured."""

    __slots__ = ()

    @property
    def sensed(self) -> Sensed:
        """What the sensor of the output measures."""
        return "velocity"


class OfAcceleration(Units):
    """Where the output's acceleration was measured."""

    __slots__ = ()

    @property
    def sensed(self) -> Sensed:
        """What the sensor of the output measures."""
        return "acceleration"


OF: dict[Sensed, type[Units]] = {"position": Units, "velocity": OfVelocity, "acceleration": OfAcceleration}
USUAL = Units()
MODEL_UNIT = re.compile(r"(/?)(?<![A-Za-z])([Vm])(?![A-Za-z])")


@contextmanager
def shown_in(units: Iterable[str]) -> Iterator[None]:
    """Within it, in this task or thread, ``readable``, ``motion`` and what they make are in these of CHOICES; what is none of them is ignored."""
    token = _CHOSEN.set(tuple(name for name in units if any(name in names for names in CHOICES.values())))
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def chosen_units() -> tuple[str, ...]:
    """What ``shown_in`` has chosen."""
    return _CHOSEN.get()


def _as_chosen(unit: str) -> tuple[float, str] | None:
    """Factor and unit in what the reader has chosen; None where nothing was chosen for it."""
    counted = _counted(unit)
    rest = unit[len(counted) :]
    name = next((name for name in _CHOSEN.get() if name in CHOICES.get(counted, {})), "")
    if not name or rest.startswith("^"):
        return None
    factor = CHOICES[counted][name]
    if name != "rpm":
        return factor, f"{name}{rest}"
    if rest.startswith("/s^2"):
        return factor, f"rpm/s{rest[4:]}"
    return (factor, f"rpm{rest[2:]}") if rest.startswith("/s") else (factor / 60, f"rev{rest}")


def readable(unit: str) -> tuple[float, str]:
    """Factor and unit as people read it: times and lengths in thousandths, anything else as it is; or as chosen."""
    chosen = _as_chosen(unit)
    if chosen is not None:
        return chosen
    return (1e3, f"m{unit}") if unit == "s" or _counted(unit) == "m" else (1.0, unit)


def motion(unit: str) -> tuple[float, str]:
    """Factor and unit as people read a motion or its speed: mm and mm/s, mrad and mrad/s, counts as they are; or as chosen."""
    chosen = _as_chosen(unit)
    if chosen is not None:
        return chosen
    return (1e3, f"m{unit}") if _counted(unit) in MOVED else (1.0, unit)


def moved(value: float, unit: str, digits: int = 3) -> str:
    """A motion or its speed with its unit: 0.33 mm/s."""
    scale, shown = motion(unit)
    return f"{_digits(scale * value, digits)} {shown}"


def bare(value: float, unit: str, digits: int = 3) -> str:
    """As ``moved``, without the unit, where another figure beside it names it."""
    return _digits(motion(unit)[0] * value, digits)


def _digits(value: float, digits: int) -> str:
    """So many significant digits, large numbers in full: 3900, not 3.9e+03."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < BEYOND_REASON else text


def _counted(unit: str) -> str:
    """What is counted, whatever it is over: the m of m/s/V."""
    return re.split("[/^]", unit)[0]


def derivative_of(unit: str) -> int:
    """How often a position was differentiated to give this unit: 0 for m, 1 for m/s, 2 for m/s^2."""
    return 2 if unit.endswith("/s^2") else int(unit.endswith("/s"))


def position_of(unit: str) -> str:
    """The unit of the position that a velocity or an acceleration has: m of m/s^2."""
    return unit.removesuffix("/s^2").removesuffix("/s")


def units_of(given: str, measured: str) -> Units:
    """Units of the input and of the position, whichever of its derivatives was measured."""
    return Units(given, position_of(measured))


def over(top: str, bottom: str) -> str:
    """One unit over another: m/V, rad/(N m)."""
    return f"{top}/{bottom}" if bottom.isalpha() else f"{top}/({bottom})"


def listed(names: Sequence[str]) -> str:
    """Names in a sentence: a, b and c."""
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)
