"""The range of each number in a public call, by the name of its argument, and of text and samples."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.samples.recording import Recording, Run

LARGEST = 1e100  # of any number: its square and its cube still are numbers
LARGEST_SAMPLE = 1e50  # a fit multiplies up to five of them
LARGEST_FLOAT = float(np.finfo(np.float64).max)
LONGEST_NAME, LONGEST_PATH = 255, 4096  # bytes that file systems take
ABOVE = 5e-324  # the smallest positive number: zero is outside the range
MOST_HZ = 1e9
Range = tuple[float, float, str]
FINITE = (-LARGEST, LARGEST, "")
OWN = (-LARGEST, LARGEST, " ")  # constructors check infinite numbers and NaN themselves
RANGES: dict[str, Range] = {
    "averages": (0.0, math.inf, ""),
    "axis_months": (ABOVE, 1e9, "months"),
    "bandwidth": (ABOVE, MOST_HZ, "Hz"),
    "budget": (0.0, math.inf, "s"),
    "first": (0, 10**12, ""),
    "hidden": (0, 2**31 - 1, ""),
    "hop": (ABOVE, 1e9, ""),
    "limit": (ABOVE, 1e9, ""),
    "number": (0, 2**31 - 1, ""),
    "pade_order": (1, 10, ""),
    "period": (0, 2**31 - 1, "samples"),
    "ramp": (0.0, 1e9, "s"),
    "brake": (0.0, 1e9, ""),
    "rate": (ABOVE, MOST_HZ, "Hz"),
    "rate_error": (0.0, 1.0, ""),
    "resolution": (0.0, MOST_HZ, "Hz"),
    "sample": (0, 10**12, ""),
    "sampling_rate": (ABOVE, MOST_HZ, "Hz"),
    "sampling_time": (ABOVE, 1e9, "s"),
    "seconds": (0.0, math.inf, "s"),
    "seed": (0, 2**31 - 1, ""),
    "smoothing": (1, 2**31 - 1, "lines"),
    "tolerance": (ABOVE, 1.0, ""),
    "width": (ABOVE, 100.0, ""),
    "workers": (0, 4096, ""),
}


def outside(value: Any, bounds: Range, usual: Any, a_path: bool) -> tuple[object, str] | None:
    """The part of a value that is out of range, and what is allowed; None if nothing is.

    bounds: of each number; usual: the default, which may be infinite; a_path: whether text may be one
    """
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        low, high, unit = bounds
        if isinstance(value, int) and abs(value) > LARGEST_FLOAT:
            return "a whole number of many digits", _words(-LARGEST, LARGEST, "")
        own = (bounds is OWN and not math.isfinite(value)) or (value == usual and isinstance(usual, float))
        return None if own or low <= value <= high else (value, _words(low, high, unit))
    if isinstance(value, str | Path):
        return None if _is_text(str(value), a_path) else ("text with null bytes, or too long", "text that can be the name of a file")
    if isinstance(value, Run | Recording):
        sizes = [max(float(np.max(part, initial=0.0)), -float(np.min(part, initial=0.0))) for part in (value.voltage, value.position)]
        return (f"samples up to {max(sizes):.3g} in size", f"up to {LARGEST_SAMPLE:g}") if max(sizes) > LARGEST_SAMPLE else None
    parts = value if isinstance(value, list | tuple) and len(value) <= LONGEST_PATH else ()
    return next((found for part in parts if (found := outside(part, bounds, usual, a_path)) is not None), None)


def _is_text(text: str, a_path: bool) -> bool:
    try:
        coded = os.fsencode(text)
    except UnicodeEncodeError:
        return False
    longest = max(map(len, coded.split(b"/"))) if a_path else 0
    return b"\0" not in coded and len(coded) <= LONGEST_PATH and longest <= LONGEST_NAME


def _words(low: float, high: float, unit: str) -> str:
    if high == LARGEST:
        return "a finite number"
    first, last = "above 0" if low == ABOVE else f"{low:g} or more", f"{high:.10g}"
    return f"{first if high == math.inf else f'{first}, up to {last}' if low == ABOVE else f'{low:g} to {last}'} {unit}".rstrip()
