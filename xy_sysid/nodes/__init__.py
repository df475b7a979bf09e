"""ROS 2 nodes: thin adapters around the core.

Linear algebra runs in one thread, for identical results in every run and free cores for the data path. This is set before numpy is imported.
"""

from __future__ import annotations

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
