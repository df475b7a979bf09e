"""Executable ``ballscrew``: the simulated XY table as a node, from voltage blocks to encoder positions."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import executable

main = executable("xy_sim.ballscrew_node:BallscrewNode")

if __name__ == "__main__":
    sys.exit(main())
