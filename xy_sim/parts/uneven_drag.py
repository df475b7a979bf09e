"""Uneven drag: the drag varies at random along the travel."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="uneven_drag",
    kind="friction",
    group="imperfection",
    law="drag -> drag max(1 + depth curve(q / length), 0.1)",
    meaning="guides that are not straight, uneven grease, varying preload",
    source="Armstrong-Helouvry 1991, ch. 3: position-dependent friction; smooth random curve",
    parameters=(
        Parameter("depth", "", 0.05, 0.02, 0.1, "rms of the relative change", 0.0, 0.9),
        Parameter("length", "m", 3e-3, 1e-3, 8e-3, "distance over which it changes", 1e-5, 10.0),
        Parameter("seed", "", 1.0, 1.0, 1e6, "seed of the curve", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)
