"""The process of the demo's controller: ``python -m xy_sysid.nodes.demo_follower``. For the simulated machine of ``xy-sysid demo --use`` only."""

from __future__ import annotations

import sys

from xy_sysid.nodes.run import executable

main = executable("xy_sysid.nodes.demo_follower_node:DemoFollowerNode")

if __name__ == "__main__":
    sys.exit(main())
