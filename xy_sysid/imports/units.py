"""Units of foreign files: lengths, voltages and times become SI, anything else is carried and named."""

from __future__ import annotations

import numpy as np

from xy_sysid.stream import FloatArray

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
    "deg": ("rad", np.pi / 180),
    "mrad": ("rad", 1e-3),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "µs": ("s", 1e-6),
    "μs": ("s", 1e-6),
    "ns": ("s", 1e-9),
}


def to_si(values: FloatArray, unit: str, what: str, notes: list[str]) -> tuple[FloatArray, str]:
    """Values in SI and the name of their unit; a note says what was converted, or that a unit is not known."""
    name, scale = SCALES.get(unit, (unit, 1.0))
    if scale == 1.0:
        return values, name
    notes.append(f"{what} is converted from {unit} to {name}")
    return values * scale, name
