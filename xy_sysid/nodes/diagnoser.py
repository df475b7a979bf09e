"""Executable ``diagnoser``."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import executable

main = executable("xy_sysid.nodes.diagnoser_node:DiagnoserNode")

if __name__ == "__main__":
    sys.exit(main())
