"""ROS 2 nodes: thin adapters around the core.

Linear algebra runs in one thread: the same bits on every run, and no core is taken from the data path. Set before numpy is imported.
"""

from __future__ import annotations

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
