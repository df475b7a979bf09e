"""Executable ``diagnoser``."""

from __future__ import annotations

import os
import sys

from xy_sysid.nodes.run import Runnable, run_node


def make() -> Runnable:
    """The node; its imports wait until the signals are in hand and rclpy is known to be there."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # before numpy is imported: with one BLAS thread a replay repeats bit for bit
    from xy_sysid.nodes.diagnoser_node import DiagnoserNode

    return DiagnoserNode()


def main() -> int:
    """Run the node; the exit code."""
    return run_node(make)


if __name__ == "__main__":
    sys.exit(main())
