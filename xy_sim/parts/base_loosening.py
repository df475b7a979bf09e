"""Loosening bolts of the base: its stiffness falls during the run."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="base_loosening",
    kind="structure",
    group="event",
    law="frequency of base_resonance -> frequency - clip(rate (t - start), 0, drop)",
    meaning="the stiffness of the feet falls; the alarm must detect this damage",
    source="Junker, New criteria for self-loosening of fasteners under vibration, SAE 690055 (1969)",
    parameters=(
        Parameter("drop", "Hz", 2.0, 1.0, 3.0, "total fall of the frequency", 0.0, 1000.0),
        Parameter("start", "s", 30.0, 20.0, 60.0, "when it begins", 0.0, 1e9),
        Parameter("rate", "Hz/s", 1.0, 0.2, 1.0, "rate of the fall", 1e-9, 1e6),
    ),
)


@inlined
def frequency(nominal: float, drop: float, start: float, rate: float, t: float) -> float:
    """Base frequency at ``t`` (s), Hz."""
    return nominal - min(max(rate * (t - start), 0.0), drop)
