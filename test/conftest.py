"""Configuration of all tests."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from _pytest.faulthandler import fault_handler_stderr_fd_key

from xy_sysid.processes.memory import keep_freed_memory

if TYPE_CHECKING:
    from helpers.ros_tools import World

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):  # as commands and nodes set it: reproducible bit for bit, and faster
    os.environ.setdefault(_name, "1")

keep_freed_memory()  # as commands do

os.environ.setdefault("COLUMNS", "400")  # commands break lines at a terminal's width; a test finds a sentence in one line

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background: children would inherit the ignored Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)

LIVE = (  # files that mostly wait for nodes and browsers, the longest first
    "page/test_page_live.py",
    "nodes/test_node_commands.py",
    "page/test_page_browser.py",
    "nodes/test_node_identifier.py",
    "cli/test_cli_live.py",
    "nodes/test_node_diagnoser.py",
    "page/test_page_stop.py",
    "nodes/test_node_safety.py",
    "nodes/test_node_excitation.py",
    "page/test_page_demo.py",
)
COMPUTING = (  # files that compute, the longest first
    "test_readme.py",
    "real/test_real_data_search.py",
    "greybox/test_one_step.py",
    "files/test_effect_file_errors.py",
    "live/test_identifier.py",
    "test_examples.py",
    "processes/test_story_worker.py",
    "real/test_real_data_effects.py",
    "cli/test_cli_processes.py",
    "effects/test_effects_contract.py",
)
LONG = [name for pair in zip(LIVE, COMPUTING, strict=True) for name in pair]


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """The output of a crash is shown, also after rclpy has redirected it to the output that pytest captures."""
    from helpers import ros_tools

    ros_tools.CRASHES = config.stash[fault_handler_stderr_fd_key]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first, alternating between waiting and computing ones; with several workers xdist starts with files of many tests."""
    root = Path(__file__).parent
    place = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.relative_to(root).as_posix(), len(place)))


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """A separate ROS domain, in which every process ends with the test."""
    from helpers.ros_tools import world_in

    with world_in(tmp_path) as made:
        yield made
