"""EMPS, a measured prismatic axis (Janot, Gautier & Brunot 2019): closed loop, dry friction, no truth to look up.

    python emps.py PATH/emps_train.npz

Where to get it, and what is known of it: docs/real-data.md.
"""

import sys
from pathlib import Path

import xy_sysid as xy

path = Path(sys.argv[1] if len(sys.argv) > 1 else "emps_train.npz")
if not path.exists():
    sys.exit(f"{path} is not here: see docs/real-data.md for where to get it.")
run = xy.load(path).run("x")
print(run)
found = xy.diagnose(run)
print(found.sentence)
for place in found.where.places[:3] if found.where else ():
    print("  the rigid model fails:", place.sentence)
