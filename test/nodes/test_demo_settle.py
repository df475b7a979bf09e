"""xy-sysid demo --settle without a page, over DDS: from the first recording to the name of the effect, and the same decisions from its bags."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.busy import PATIENCE
from helpers.cli_tools import bare, cli
from helpers.ros_tools import clean, needs_ros, new_domain

LONG = "a minute of processor time; the walk itself is tested on the page: set XY_SYSID_LONG_TESTS=1"
pytestmark = [needs_ros, pytest.mark.skipif(not os.environ.get("XY_SYSID_LONG_TESTS"), reason=LONG)]


def test_the_demo_settles_what_pulls_the_arm_back_and_its_bags_replay_the_decisions(tmp_path: Path) -> None:
    """It ends by itself with exit code 0, names gravity after experiments within the budget, and ``next --replay`` gives the same decisions."""
    domain = new_domain()
    words = [sys.executable, "-m", "xy_sysid", "demo", "--settle", "--no-page", "--json", "--speed", "0"]
    environment = bare(ROS_DOMAIN_ID=str(domain), TMPDIR=str(tmp_path))
    try:
        made = subprocess.run(words, cwd=tmp_path, env=environment, text=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE * 240)
    finally:
        clean(domain)
    assert made.returncode == 0, made.stderr + made.stdout
    answer = json.loads(made.stdout)
    last = answer["steps"][-1]
    assert answer["ending"] == "settled" and answer["problem"] is None
    assert last["chosen"] == ["gravity"] and 1 <= last["experiments"] <= 4 and last["seconds"] <= 60.0
    folder = Path(answer["folder"])
    assert folder.is_relative_to(tmp_path) and (folder / "next_1.yaml").exists()
    assert cli("next", "--replay", folder).code == 0
