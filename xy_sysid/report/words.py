"""Numbers as people read them: mm, ms, Hz, a true minus sign, an interval."""

from __future__ import annotations

import math

from xy_sysid.fitting import Estimate

SMALL = {"s": "ms", "m": "mm", "m/s": "mm/s", "m/s/V": "mm/s/V", "m/V": "mm/V", "m/(V s)": "mm/(V s)"}  # 1000 of the second make one of the first


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
        if 1.0 <= abs(value) < 1e7:
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


def digits_for(item: Estimate) -> int:
    """So many that the interval's half width shows two digits, 3 to 8."""
    half = item.high - item.value
    if not (math.isfinite(half) and half > 0 and item.value != 0):
        return 5
    return int(min(max(math.floor(math.log10(abs(item.value))) - math.floor(math.log10(half)) + 2, 3), 8))


def estimate_text(item: Estimate) -> str:
    """value [low, high] unit."""
    scale, shown = people_unit(item.unit)
    digits = digits_for(item)
    value, low, high = (number(each * scale, digits) for each in (item.value, item.low, item.high))
    return f"{value} [{low}, {high}] {shown}".rstrip()


def root(value: complex, digits: int = 4) -> str:
    """One root, or a conjugate pair as a ± bj."""
    if value.imag == 0:
        return number(value.real, digits)
    return f"{number(value.real, digits)} ± {number(abs(value.imag), digits)}j"
