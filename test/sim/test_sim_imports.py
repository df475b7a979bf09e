"""The simulated machine and the identification are independent."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import ROOT

SHARED = {"xy_sysid.jit", "xy_sysid.errors", "xy_sysid.samples.block", "xy_sysid.settings", "xy_sysid.bags.opening"}
ADAPTERS = {
    "node.py",
    "ballscrew_node.py",
    "controller_node.py",
    "trajectory_node.py",
}  # the ROS side of the machine: it also uses the common modules of nodes
SIM = sorted((ROOT / "xy_sim").rglob("*.py"))
ASKED_FOR = ROOT / "xy_sysid" / "front_door" / "simulated_recording.py"  # xy.simulate
CORE = sorted(path for path in (ROOT / "xy_sysid").rglob("*.py") if "cli" not in path.relative_to(ROOT / "xy_sysid").parts and path != ASKED_FOR)


def imported(path: Path) -> Iterator[str]:
    """Every module that a file imports, anywhere in it; ``from package import name`` gives ``package.name`` too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import hides its source"
            yield node.module or ""
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", SIM, ids=lambda path: str(path.relative_to(ROOT)))
def test_the_simulator_imports_no_physics_of_the_identification(path: Path) -> None:
    """xy_sim may use the errors, settings, blocks, compiler and bounded YAML of xy_sysid, its ROS node also the common modules of nodes."""
    foreign = {name for name in imported(path) if name.split(".")[0] == "xy_sysid"}
    shared = SHARED | {"xy_sysid.nodes", "xy_sysid.live.recent"} if path.name in ADAPTERS else SHARED
    assert {name for name in foreign if not any(name == module or name.startswith(f"{module}.") for module in shared)} == set()


def test_no_module_but_the_command_line_and_xy_simulate_imports_the_simulator() -> None:
    """xy_sysid cannot import the truth that it is compared with."""
    assert len(SIM) > 20
    assert len(CORE) > 3
    assert [str(path) for path in CORE if any(name.split(".")[0] == "xy_sim" for name in imported(path))] == []
