"""Numbers for readers: mm, ms, Hz, a true minus sign, an interval."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xy_sysid.units import motion, readable

if TYPE_CHECKING:
    from xy_sysid.response.estimate import Estimate

LARGE, TINY = 1e6, 1e-4  # numbers are written with a power of ten from LARGE on and below TINY


def number(value: float, digits: int = 4) -> str:
    """The number with this many significant digits and a true minus; a dash if not finite."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    if "e" in text:
        if 1.0 <= abs(value) < LARGE:
            return f"{float(text):.0f}".replace("-", "−")
        mantissa, _, exponent = text.partition("e")
        text = f"{mantissa}·10{superscript(int(exponent))}"
    return text.replace("-", "−")


def superscript(value: int) -> str:
    """A whole number in raised digits."""
    return str(value).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A number in its display unit."""
    scale, shown = readable(unit)
    return f"{number(value * scale, digits)} {shown}".rstrip()


def moved(value: float, unit: str) -> str:
    """A motion or speed in its display unit."""
    scale, shown = motion(unit)
    return f"{number(value * scale, 3)} {shown}"


def possible(name: str, figures: tuple[float, float, float]) -> tuple[float, float, float]:
    """Value and both ends of an interval, clipped to possible values: a delay, friction or gap is never below zero.

    name: of the parameter, as in ``gain`` or ``effect.parameter``
    """
    value, low, high = figures
    if value >= 0.0 > low and _not_negative(name):
        low = 0.0
    return value, low, high


def _not_negative(name: str) -> bool:
    effect, _, own = name.partition(".")
    if not own:
        return effect == "delay"
    from xy_sysid.axis.model import STANDARD  # takes a second to import; callers that only draw do not need it

    known = STANDARD.effects.get(effect)
    return known is not None and any(item.name == own and item.low >= 0.0 for item in known.parameters)


def interval_parts(value: float, low: float, high: float) -> tuple[str, str, str, str]:
    """(value, low, high, power of ten) with as many decimals as show two digits of the half width, zeros kept."""
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and half > 0.0):
        return number(value, 5), number(low, 5), number(high, 5), ""
    size = max(abs(low), abs(high))
    exponent = math.floor(math.log10(size)) if size >= LARGE or size < TINY else 0
    decimals = min(max(1 - math.floor(math.log10(half)) + exponent, 0), 9)
    value_text, low_text, high_text = (f"{each / 10.0**exponent:.{decimals}f}".replace("-", "−") for each in (value, low, high))
    return value_text, low_text, high_text, f"·10{superscript(exponent)}" if exponent else ""


def interval_text(value: float, low: float, high: float, unit: str, name: str = "") -> str:
    """value [low, high] unit, in display units; name: of the parameter, whose impossible values are clipped."""
    scale, shown = readable(unit)
    value, low, high = possible(name, (value, low, high))
    middle, first, last, power = interval_parts(value * scale, low * scale, high * scale)
    return f"{middle} [{first}, {last}]{power} {shown}".rstrip()


def estimate_text(item: Estimate) -> str:
    """value [low, high] unit."""
    return interval_text(item.value, item.low, item.high, item.unit, item.name)


def root(value: complex) -> str:
    """One root, or a conjugate pair as a ± bj."""
    if value.imag == 0:
        return number(value.real, 4)
    return f"{number(value.real, 4)} ± {number(abs(value.imag), 4)}j"
