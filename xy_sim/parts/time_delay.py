"""Time delay of computation, bus and drive."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="time_delay",
    kind="input",
    group="base",
    law="v(t) = u(t - delay)",
    meaning="fixed delay of the whole chain from command to current, including fractions of a sample",
    source="measured on the paper's table: 1.29 ms (x), 1.38 ms (y)",
    parameters=(Parameter("delay", "s", 1.29e-3, 0.5e-3, 3e-3, "time from a voltage sample to its effect", 0.0, 1.0),),
)


@inlined
def samples(delay: float, rate: float) -> tuple[int, float]:
    """Whole sample periods of a delay (s) at ``rate`` (Hz), and the remainder, s."""
    whole = int(delay * rate + 1e-9)
    rest = delay - whole / rate
    return whole, rest if rest > 1e-12 else 0.0
