"""Executable ``identifier``."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import Runnable, run_node


def make() -> Runnable:
    """The node; its imports wait until the signals are in hand and rclpy is known to be there."""
    from xy_sysid.nodes.identifier_node import IdentifierNode

    return IdentifierNode()


def main() -> int:
    """Run the node; the exit code."""
    return run_node(make)


if __name__ == "__main__":
    sys.exit(main())
