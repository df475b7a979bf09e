"""Backlash: motor and table are coupled through a gap."""

from __future__ import annotations

from xy_sim.parts.contract import Parameter, Part

PART = Part(
    name="backlash",
    kind="structure",
    group="effect",
    law="f = contact(x_motor - x_table, gap / 2); each side is a mass of its own",
    meaning="a nut without preload, a worn coupling",
    source="Nordin & Gutman, Controlling mechanical systems with backlash, Automatica 38 (2002), sec. 2.2; contact after Hunt & Crossley 1975",
    parameters=(
        Parameter("gap", "m", 20e-6, 8e-6, 60e-6, "free travel between the flanks", 1e-9, 0.1),
        Parameter("stiffness", "N/m", 2e7, 2e7, 2e7, "stiffness of the flanks; screw_compliance, if present, replaces it", 1e3, 1e9),
        Parameter("damping", "s/m", 20.0, 20.0, 20.0, "loss of the contact per approach speed"),
    ),
)
