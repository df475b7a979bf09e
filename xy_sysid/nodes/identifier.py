"""Executable ``identifier``."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import executable

main = executable("xy_sysid.nodes.identifier_node:IdentifierNode")

if __name__ == "__main__":
    sys.exit(main())
