"""All friction varies slowly and at random."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="friction_wander",
    kind="friction",
    group="imperfection",
    law="drag and all dry friction, times max(1 + depth curve(t / time), 0.1)",
    meaning="grease moves, balls enter and leave the load zone, seals dry",
    source="Olsson et al. 1998, sec. 1 (friction is not repeatable); smooth random curve",
    parameters=(
        Parameter("depth", "", 0.05, 0.02, 0.1, "rms of the relative change", 0.0, 0.9),
        Parameter("time", "s", 5.0, 2.0, 10.0, "time over which it changes", 0.01, 1e6),
        Parameter("seed", "", 4.0, 1.0, 1e6, "seed of the curve", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)
