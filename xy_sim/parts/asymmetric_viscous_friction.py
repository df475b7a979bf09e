"""Viscous friction that differs between the two directions."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="asymmetric_viscous_friction",
    kind="friction",
    group="effect",
    law="f = drag (1 + asymmetry sign(v)) v",
    meaning="seals and wipers with more drag in one direction than in the other",
    source="Janot, Gautier & Brunot, Data set and reference models of EMPS, Nonlinear System Identification Benchmarks 2019",
    parameters=(
        Parameter("asymmetry", "", 0.2, 0.1, 0.4, "relative difference of each direction from the mean; positive: larger forth", -1.0, 1.0, True),
    ),
    drawn=False,
)


@inlined
def factor(asymmetry: float, v: float) -> float:
    """Drag at speed ``v`` over the mean of both directions."""
    return 1.0 + asymmetry if v >= 0.0 else 1.0 - asymmetry
