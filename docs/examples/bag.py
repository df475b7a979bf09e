"""A bag from a ROS 2 machine: both axes, the response of each, and whether a model of yesterday still holds.

    python bag.py BAG [BAG_OF_TODAY]

A bag has the topics /xy/voltage and /xy/position (docs/topics.md); others are named in ``xy.load(bag, voltage_topic=..., position_topic=...)``.
"""

import subprocess
import sys

import xy_sysid as xy


def example(name: str, seed: int) -> str:
    """A bag as ``xy-sysid record`` writes it, for those who have no machine at hand."""
    subprocess.run([sys.executable, "-m", "xy_sysid", "simulate", name, "--duration", "30", "--seed", str(seed)], check=True)
    return name


bags = sys.argv[1:3] or [example("yesterday", 1), example("today", 2)]
first, last = xy.load(bags[0]), xy.load(bags[-1])
print(first)
for axis in first.axes:
    model = xy.fit(xy.frf(first.run(axis)))
    print(model)
    print(axis, xy.validate(last.run(axis), model).sentence)
