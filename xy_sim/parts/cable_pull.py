"""Cable pull: a force that depends on position and, with hysteresis, on direction."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts import curve
from xy_sim.parts.contract import Parameter, Part
from xy_sysid.samples.block import FloatArray

PART = Part(
    name="cable_pull",
    kind="force",
    group="imperfection",
    law="f = -pull (curve(q / length) + z / reach); z' = v - |v| z / reach",
    meaning="forces of cables and hoses, with hysteresis after each reversal",
    source="hysteresis: P. Dahl, A solid friction model, 1968; smooth random curve",
    parameters=(
        Parameter(
            "pull", "V", 0.02, 0.01, 0.05, "drive voltage that holds it: rms of the position-dependent part, maximum of the hysteresis", 0.0, 100.0
        ),
        Parameter("reach", "m", 1e-3, 0.3e-3, 3e-3, "distance after a reversal in which the pull changes sides", 1e-5, 10.0),
        Parameter("length", "m", 5e-3, 2e-3, 10e-3, "distance over which the position-dependent part changes", 1e-5, 10.0),
        Parameter("seed", "", 5.0, 1.0, 1e6, "seed of the curve", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)


@inlined
def rate(z: float, v: float, reach: float) -> float:
    """z', m/s."""
    return v - abs(v) * z / reach


@inlined
def force(p: FloatArray, first: int, pull: float, reach: float, length: float, q: float, z: float) -> float:
    """Force on the table at ``q`` (m), V; the curve begins at ``first`` of ``p``."""
    return -pull * (curve.value(p, first, q / length) + z / reach)
