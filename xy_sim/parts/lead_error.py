"""Lead error: a periodic error of the screw or the scale."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="lead_error",
    kind="encoder",
    group="effect",
    law="reading = q + amplitude sin(2 pi per_revolution q / lead + phase)",
    meaning="wobble of the screw or an encoder disk off centre",
    source="ISO 3408-3: 2006, travel deviation within one revolution",
    parameters=(
        Parameter("amplitude", "m", 8e-6, 4e-6, 20e-6, "largest error", 0.0, 1e-2),
        Parameter("per_revolution", "", 1.0, 1.0, 2.0, "periods in one turn of the screw", 0.01, 1000.0, whole=True),
        Parameter("phase", "rad", 0.0, -3.0, 3.0, "phase at the origin", -10.0, 10.0),
    ),
)


@inlined
def reading(amplitude: float, wavenumber: float, phase: float, q: float) -> float:
    """Reading of the encoder at ``q`` (m), m; wavenumber in rad/m."""
    return q + amplitude * (math.sin(wavenumber * q + phase) - math.sin(phase)) if amplitude != 0.0 else q
