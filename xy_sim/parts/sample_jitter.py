"""Sample jitter: the encoder is read at random times around the sample instants."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts import chance
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="sample_jitter",
    kind="encoder",
    group="imperfection",
    law="reading = q + v e; e uniform in -largest..largest, new for each sample",
    meaning="a delayed interrupt, a busy bus",
    source="Wittenmark, Nilsson & Torngren, Timing problems in real-time control systems, ACC 1995; first order in e",
    parameters=(
        Parameter("largest", "s", 20e-6, 2e-6, 20e-6, "largest timing error", 0.0, 1e-3),
        Parameter("seed", "", 6.0, 1.0, 1e6, "seed of the errors", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)


@inlined
def shift(largest: float, seed: float, v: float, sample: int) -> float:
    """Error of the reading of sample number ``sample`` at speed ``v`` (m/s), m."""
    return v * largest * chance.centred(seed, sample)
