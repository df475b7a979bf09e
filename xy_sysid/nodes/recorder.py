"""Executable ``recorder``."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import executable

main = executable("xy_sysid.nodes.recorder_node:RecorderNode")

if __name__ == "__main__":
    sys.exit(main())
