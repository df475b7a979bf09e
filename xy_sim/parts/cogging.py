"""Cogging: a force that varies sinusoidally with position."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="cogging",
    kind="force",
    group="effect",
    law="f = amplitude sin(2 pi per_revolution q / lead + phase)",
    meaning="magnets against slots, ripple of the current sensor",
    source="Hanselman, Brushless Permanent Magnet Motor Design, 2003, ch. 5",
    parameters=(
        Parameter("amplitude", "V", 0.15, 0.05, 0.4, "drive voltage that overcomes it", 0.0, 100.0),
        Parameter("per_revolution", "", 4.0, 2.0, 8.0, "periods in one turn of the screw", 0.01, 1000.0, whole=True),
        Parameter("phase", "rad", 0.0, -3.0, 3.0, "phase at the origin", -10.0, 10.0),
    ),
)


@inlined
def force(amplitude: float, wavenumber: float, phase: float, q: float) -> float:
    """Force against motion at ``q`` (m), V; wavenumber in rad/m."""
    return amplitude * math.sin(wavenumber * q + phase)


@inlined
def energy(amplitude: float, wavenumber: float, phase: float, q: float) -> float:
    """Potential at ``q`` (m), V m."""
    return amplitude * (1.0 - math.cos(wavenumber * q + phase)) / wavenumber if wavenumber > 0.0 else 0.0
