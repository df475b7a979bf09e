"""Uneven lines: position errors of the encoder lines."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts import curve
from xy_sim.parts.contract import Parameter, Part
from xy_sysid.samples.block import FloatArray

PART = Part(
    name="uneven_lines",
    kind="encoder",
    group="imperfection",
    law="reading = q + fine (sin(a) + sin(2 a + 1) / 2) + wave curve(q / length), less that at 0; a = 2 pi q / period",
    meaning="interpolation error within a line, and a scale with local stretch",
    source="R. C. Kavanagh, Probabilistic learning technique for improved accuracy of sinusoidal encoders, IEEE TIE 48 (2001); ISO 3408-3: 2006",
    parameters=(
        Parameter("fine", "m", 0.2e-6, 0.05e-6, 0.5e-6, "error of the interpolation", 0.0, 1e-2),
        Parameter("wave", "m", 5e-6, 1e-6, 10e-6, "rms of the long waves", 0.0, 1e-2, power=1.0),
        Parameter("period", "m", 20e-6, 20e-6, 100e-6, "distance between lines", 1e-7, 1.0),
        Parameter("length", "m", 3e-3, 1e-3, 8e-3, "distance over which the long waves change", 1e-5, 10.0),
        Parameter("seed", "", 8.0, 1.0, 1e6, "seed of the long waves", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)


@inlined
def error(p: FloatArray, first: int, fine: float, wave: float, period: float, length: float, q: float) -> float:
    """Error of the encoder reading at ``q`` (m), m; the curve begins at ``first`` of ``p``."""
    a = 2.0 * math.pi * q / period
    short = fine * (math.sin(a) + 0.5 * (math.sin(2.0 * a + 1.0) - math.sin(1.0)))
    return short + wave * (curve.value(p, first, q / length) - curve.value(p, first, 0.0))
