"""Late drive: voltages act at random times around their sample instants."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts import chance
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="late_drive",
    kind="input",
    group="imperfection",
    law="v(t) = u(t - delay - e); e uniform in -largest..largest, new for each sample, never before the command",
    meaning="the cycle of the drive is not synchronised to the controller, or its task is late",
    source="Wittenmark, Nilsson & Torngren, Timing problems in real-time control systems, ACC 1995",
    parameters=(
        Parameter("largest", "s", 50e-6, 5e-6, 100e-6, "largest timing error; half a sample at most", 0.0, 1.0),
        Parameter("seed", "", 7.0, 1.0, 1e6, "seed of the errors", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)


@inlined
def lateness(largest: float, seed: float, sample: int) -> float:
    """Timing error of the voltage of sample number ``sample``, s; positive is late."""
    return largest * chance.centred(seed, sample)
