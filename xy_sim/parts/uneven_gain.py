"""Uneven gain: the motor constant varies at random along the travel."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="uneven_gain",
    kind="drive",
    group="imperfection",
    law="f = factor(q) v, back-EMF drag times factor(q)^2; factor = max(1 + depth curve(q / length), 0.1)",
    meaning="uneven magnets, inexact commutation",
    source="Hanselman 2003, ch. 4: torque and back-EMF share one constant; smooth random curve",
    parameters=(
        Parameter("depth", "", 0.03, 0.01, 0.05, "rms of the relative change", 0.0, 0.9),
        Parameter("length", "m", 3e-3, 1e-3, 8e-3, "distance over which it changes", 1e-5, 10.0),
        Parameter("seed", "", 2.0, 1.0, 1e6, "seed of the curve", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)
