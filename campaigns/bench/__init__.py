"""Measurements against other software and against the goals: ``python -m campaigns.bench [name ...]``."""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is imported: all software is measured with one thread
