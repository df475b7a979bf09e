"""Numbers as people read them: mm, ms, Hz, a true minus sign, an interval."""

from __future__ import annotations

import math

from xy_sysid.fitting import Estimate

SMALL = {"s": "ms", "m": "mm", "m/s": "mm/s", "m/s/V": "mm/s/V", "m/V": "mm/V", "m/(V s)": "mm/(V s)"}  # 1000 of the second make one of the first

LARGE, TINY = 1e6, 1e-4  # numbers are written with a power of ten from LARGE on and below TINY


def people_unit(unit: str) -> tuple[float, str]:
    """(factor, name): 1000 and mm for m; 1 and the unit itself where people read SI."""
    if unit in SMALL:
        return 1e3, SMALL[unit]
    return (1e3, f"m{unit}") if unit.startswith(("m/", "m^")) else (1.0, unit)


def number(value: float, digits: int = 4) -> str:
    """Significant digits, with a true minus; a dash if not finite."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    if "e" in text:
        if 1.0 <= abs(value) < LARGE:
            return f"{float(text):.0f}".replace("-", "−")
        mantissa, _, exponent = text.partition("e")
        text = f"{mantissa}·10{_superscript(int(exponent))}"
    return text.replace("-", "−")


def _superscript(value: int) -> str:
    return str(value).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A number with the unit that people use for it."""
    scale, shown = people_unit(unit)
    return f"{number(value * scale, digits)} {shown}".rstrip()


def interval_parts(value: float, low: float, high: float) -> tuple[str, str, str, str]:
    """(value, low, high, power of ten) with as many decimals as show two digits of the half width, zeros kept."""
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and half > 0.0):
        return number(value, 5), number(low, 5), number(high, 5), ""
    size = max(abs(low), abs(high))
    exponent = math.floor(math.log10(size)) if size >= LARGE or size < TINY else 0
    decimals = min(max(1 - math.floor(math.log10(half)) + exponent, 0), 9)
    value_text, low_text, high_text = (f"{each / 10.0**exponent:.{decimals}f}".replace("-", "−") for each in (value, low, high))
    return value_text, low_text, high_text, f"·10{_superscript(exponent)}" if exponent else ""


def interval_text(value: float, low: float, high: float, unit: str) -> str:
    """value [low, high] unit, in people's units."""
    scale, shown = people_unit(unit)
    middle, first, last, power = interval_parts(value * scale, low * scale, high * scale)
    return f"{middle} [{first}, {last}]{power} {shown}".rstrip()


def estimate_text(item: Estimate) -> str:
    """value [low, high] unit."""
    return interval_text(item.value, item.low, item.high, item.unit)


def root(value: complex, digits: int = 4) -> str:
    """One root, or a conjugate pair as a ± bj."""
    if value.imag == 0:
        return number(value.real, digits)
    return f"{number(value.real, digits)} ± {number(abs(value.imag), digits)}j"
