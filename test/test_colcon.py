"""The same tree as a colcon package: built in a copy, and a node run from the installation."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import ROOT
from helpers.ros_tools import new_domain

EXECUTABLES = {"xy-sysid", "excitation", "identifier", "diagnoser", "recorder", "ballscrew"}

pytestmark = [
    pytest.mark.skipif(importlib.util.find_spec("colcon_ros") is None, reason="colcon comes with the extra [test]"),
    pytest.mark.skipif(shutil.which("bash") is None, reason="bash reads the setup files"),
]
needs_ros = pytest.mark.skipif(importlib.util.find_spec("rclpy") is None, reason="rclpy comes with the extra [ros]")


def clean_environment() -> dict[str, str]:
    """The environment without variables of another workspace."""
    left_out = ("AMENT_", "COLCON_", "PYTHONPATH", "ROS_DISTRO")
    return {key: value for key, value in os.environ.items() if not key.startswith(left_out)}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A built workspace with a copy of the files in git."""
    space = tmp_path_factory.mktemp("ws")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git clone")
    for name in listed.stdout.decode().split("\0"):
        if name and (ROOT / name).is_file():
            target = space / "src" / "xy_sysid" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
    built = subprocess.run(
        [sys.executable, "-m", "colcon", "build", "--executor", "sequential"],
        cwd=space,
        env=clean_environment(),
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    yield space
    shutil.rmtree(space, ignore_errors=True)


def in_workspace(workspace: Path, command: str) -> subprocess.Popen[str]:
    """A command in a shell with the workspace's setup file, in a separate process group and ROS domain."""
    return subprocess.Popen(
        ["bash", "-c", f". install/local_setup.bash && exec {command}"],
        cwd=workspace,
        env={**clean_environment(), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(new_domain()), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def test_colcon_takes_it_for_a_ros_package(workspace: Path) -> None:
    """The build type is ros.ament_python: the ament index marker and the hook for AMENT_PREFIX_PATH are made."""
    share = workspace / "install" / "xy_sysid" / "share"
    assert (share / "ament_index" / "resource_index" / "packages" / "xy_sysid").is_file()
    assert (share / "xy_sysid" / "hook" / "ament_prefix_path.sh").is_file()
    assert "ros.ament_python" in (workspace / "log" / "latest_build" / "logger_all.log").read_text(encoding="utf-8")


def test_executables_lie_where_ros2_run_looks(workspace: Path) -> None:
    """lib/xy_sysid has every executable."""
    found = {path.name for path in (workspace / "install" / "xy_sysid" / "lib" / "xy_sysid").iterdir() if os.access(path, os.X_OK)}
    assert found == EXECUTABLES


def test_share_has_configuration_machines_and_launch_files(workspace: Path) -> None:
    """Everything under config/ and launch/ is installed."""
    share = workspace / "install" / "xy_sysid" / "share" / "xy_sysid"
    for pattern in ("config/*.yaml", "config/*.xml", "config/machines/*.yaml", "launch/*.py", "package.xml"):
        wanted = {path.name for path in ROOT.glob(pattern)}
        assert wanted
        assert wanted <= {path.name for path in share.glob(pattern)}


def test_the_installed_package_finds_its_files(workspace: Path) -> None:
    """In the install space, configuration comes from share, not from the source tree."""
    code = "from xy_sysid.files.package_files import find; print(find('demo'))"
    found = in_workspace(workspace, f'{sys.executable} -c "{code}"').communicate(timeout=60)[0].strip()
    assert Path(found).resolve() == (workspace / "install" / "xy_sysid" / "share" / "xy_sysid" / "config" / "demo.yaml").resolve()


@needs_ros
def test_a_node_runs_from_the_install_space(workspace: Path) -> None:
    """The excitation starts, reports that it is unconfigured, and ends with code 0 on Ctrl-C."""
    node = in_workspace(workspace, "install/xy_sysid/lib/xy_sysid/excitation --ros-args -r __ns:=/t")
    assert node.stdout is not None
    too_late = threading.Timer(60.0, node.kill)
    too_late.start()
    text = ""
    for line in node.stdout:
        text += line
        if "unconfigured" in line.lower():
            node.send_signal(signal.SIGINT)
    node.wait()
    too_late.cancel()
    assert "unconfigured" in text.lower(), text
    assert node.returncode == 0, text
