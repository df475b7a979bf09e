"""The gain of the drive varies slowly and at random."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="gain_wander",
    kind="drive",
    group="imperfection",
    law="v -> v max(1 + depth curve(t / time), 0.1)",
    meaning="random changes: supply voltage, temperature of the amplifier, field weakening",
    source="Krishnan 2010, sec. 1.3 (temperature); smooth random curve",
    parameters=(
        Parameter("depth", "", 0.02, 0.01, 0.05, "rms of the relative change", 0.0, 0.9),
        Parameter("time", "s", 5.0, 2.0, 10.0, "time over which it changes", 0.01, 1e6),
        Parameter("seed", "", 3.0, 1.0, 1e6, "seed of the curve", 0.0, 1e9, whole=True),
    ),
    drawn=False,
)
