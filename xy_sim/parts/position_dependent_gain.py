"""The motor constant changes along the travel."""

from __future__ import annotations

import math

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="position_dependent_gain",
    kind="drive",
    group="added",
    law="f = factor(q) v, back-EMF drag times factor(q)^2; factor = 1 + depth sin(2 pi q / period)",
    meaning="uneven magnets of a linear motor, uneven tension of a belt",
    source="Hanselman 2003, ch. 4: torque and back-EMF share one constant",
    parameters=(
        Parameter("depth", "", 0.1, 0.05, 0.2, "largest relative change", 0.0, 0.9),
        Parameter("period", "m", 0.03, 0.02, 0.06, "length of one cycle", 1e-4, 10.0),
    ),
)


@inlined
def factor(depth: float, wavenumber: float, q: float) -> float:
    """Motor constant at ``q`` (m) over its mean; wavenumber in rad/m."""
    return 1.0 + depth * math.sin(wavenumber * q)
