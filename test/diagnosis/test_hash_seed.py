"""The same recording gives the same answer, for any order of the sets in a process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from helpers.simulated import recorded


def test_the_seed_of_the_hashes_changes_no_answer(tmp_path: Path) -> None:
    """Two processes with different hash seeds give the same bytes, except for the elapsed time."""
    voltage, position = recorded("coulomb_friction+cogging", seconds=10.0).axis("x")
    path = tmp_path / "rec.npz"
    np.savez(path, voltage=voltage, position=position, fs=2000.0)
    said = []
    for seed in ("1", "2"):
        command = [sys.executable, "-m", "xy_sysid", "diagnose", str(path), "--json"]
        done = subprocess.run(command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True)
        before, _, _ = done.stdout.rpartition('"seconds"')
        assert "cogging" in before
        said.append(before)
    assert said[0] == said[1]
