"""Amplifier lag: the current follows the command with a first-order lag."""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="amplifier_lag",
    kind="drive",
    group="effect",
    law="lag v' + v = u",
    meaning="motor inductance, filter of the command input",
    source="Krishnan, Electric Motor Drives, 2001, sec. 2.3",
    parameters=(Parameter("lag", "s", 1e-3, 0.4e-3, 2e-3, "time constant", 1e-5, 10.0),),
)


@inlined
def rate(lag: float, u: float, v: float) -> float:
    """v', V/s."""
    return (u - v) / lag
