"""xy-sysid demo --use without a page, over DDS: from the first samples to a path with a smaller error for each feedforward."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.busy import PATIENCE
from helpers.cli_tools import bare
from helpers.ros_tools import clean, needs_ros, new_domain

from xy_sysid.control_design.follower import KINDS

LONG = "a minute of processor time; the controller itself is tested in test_node_demo_follower: set XY_SYSID_LONG_TESTS=1"
pytestmark = [needs_ros, pytest.mark.skipif(not os.environ.get("XY_SYSID_LONG_TESTS"), reason=LONG)]


def test_the_demo_identifies_the_table_and_follows_a_path_better_with_each_feedforward(tmp_path: Path) -> None:
    """It ends by itself with exit code 0; on both axes kS, kV and kA halve the error of the PID, and the compensation to a fifth of that."""
    domain = new_domain()
    words = [sys.executable, "-m", "xy_sysid", "demo", "--use", "--no-page", "--json"]
    environment = bare(ROS_DOMAIN_ID=str(domain), TMPDIR=str(tmp_path))
    try:
        made = subprocess.run(words, cwd=tmp_path, env=environment, text=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE * 600)
    finally:
        clean(domain)
    assert made.returncode == 0, made.stderr + made.stdout
    answer = json.loads(made.stdout)
    assert set(answer["axes"]) == {"x", "y"} and not answer["failed"]
    for axis, found in answer["axes"].items():
        alone, simple, best = (found["errors"][kind] for kind in KINDS)
        assert simple < 0.5 * alone and best < 0.2 * simple, (axis, found)
        assert found["undone"].startswith("base"), found
