"""An axis with reversed wiring, at several voltages: time until zero volts, and travel until rest.

``python -m campaigns.faults.backwards`` prints the table of docs/real-machine-safely.md.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable

from campaigns.faults.encoder_faults import Outcome, run, scaled, settings
from xy_sim.machine import Machine
from xy_sysid.excitation.drive import Drive

LEVELS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # V rms; the last is the limit
TENTH = 0.028  # m, of the travel by default
SEEDS = 25
LONGEST = 30.0  # s


def backwards(rms: float, seed: int) -> Outcome:
    """The simulated table with a wrong sign of both encoders from the start, and default settings except rms."""
    return run(Machine.from_file("rigid.yaml", seed), Drive(settings({"rms": rms, "seed": seed})), LONGEST, scaled(-1.0))


def worst(rms: float, seeds: Iterable[int]) -> tuple[bool, float, float]:
    """True if a guard stopped all, longest time, s, and largest travel, m."""
    found = [backwards(rms, seed) for seed in seeds]
    return all(one.fault for one in found), max(one.seconds for one in found), max(one.place for one in found)


def main() -> int:
    """Print the table; returns 1 if one was not stopped within a tenth of its travel."""
    good = True
    for rms in LEVELS:
        stopped, seconds, way = worst(rms, range(1, SEEDS + 1))
        good = good and stopped and way < TENTH
        sys.stdout.write(f"| {rms:g} V | {1000 * seconds:.0f} ms | {math.ceil(1e4 * way) / 10:g} mm |{'' if stopped else ' not stopped'}\n")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
