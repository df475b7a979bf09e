"""The named values of a status: their names, which are a contract (docs/topics.md), and how an estimate is written and read back."""

from __future__ import annotations

import math
from collections.abc import Mapping

from xy_sysid.response.estimate import Estimate
from xy_sysid.units import USUAL, Units

Values = Mapping[str, str]

SECONDS = "seconds of data (s)"
RATE = "sampling rate (Hz)"
WINDOWS, DROPPED = "windows", "dropped windows"
DROPPED_FOR = f"{DROPPED}: "  # and the reason
RELATIVE_ERROR = "relative error (1)"
WATCHED, REFERENCE = "resonance watched (Hz)", "resonance reference (Hz)"
KEPT, HEARD = "seconds kept (s)", "seconds heard (s)"
INPUT_UNIT, OUTPUT_UNIT = "input unit", "output unit"
METRES = " (m)"  # the end of the name of a tracking error


def used(axis: str) -> tuple[str, str]:
    """The names of the first and the last second of the data that a story was fitted to."""
    return f"axis {axis} used from (s)", f"axis {axis} used to (s)"


def written(item: Estimate) -> dict[str, str]:
    """The values of an estimate: itself with its unit, and the ends of its interval."""
    low, high = _ends(item.name)
    return {f"{item.name} ({item.unit or '1'})": f"{item.value:.9g}", low: f"{item.low:.9g}", high: f"{item.high:.9g}"}


def estimate_of(values: Values, name: str) -> Estimate | None:
    """The estimate of this name, NaN where a number is missing; None if there is none. Its unit is 1 where it has none."""
    start = f"{name} ("
    key = next((key for key in values if key.startswith(start)), None)
    if key is None:
        return None
    unit = key.removeprefix(start).removesuffix(")")
    low, high = (number(values, end) for end in _ends(name))
    return Estimate(name=name, value=number(values, key), unit=unit, low=low, high=high)


def number(values: Values, name: str, without: float = math.nan) -> float:
    """One number; ``without`` if there is none."""
    try:
        return float(values[name])
    except (KeyError, ValueError):
        return without


def units_of(values: Values) -> Units:
    """Units of input and output."""
    return Units(values.get(INPUT_UNIT, USUAL.input), values.get(OUTPUT_UNIT, USUAL.output))


def _ends(name: str) -> tuple[str, str]:
    return f"{name} 95 % low", f"{name} 95 % high"
