"""Metadata of the package, consistent in all files."""

from __future__ import annotations

import ast
import os
import re
import runpy
import subprocess
import sys
import types
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
import yaml
from helpers import ROOT
from helpers.busy import busy


@pytest.fixture(scope="module")
def setup_arguments() -> dict[str, Any]:
    """The arguments of setup.py for setuptools."""
    with mock.patch("setuptools.setup") as setup, pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        runpy.run_path(str(ROOT / "setup.py"))
    return dict(setup.call_args.kwargs)


@pytest.fixture(scope="module")
def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / "package.xml").getroot()


def text(manifest: ElementTree.Element, tag: str) -> str:
    return (manifest.findtext(tag) or "").strip()


def test_package_xml_and_setup_py_say_the_same(setup_arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    """Name, version, licence and maintainer are equal; the mail address must be valid, or colcon finds no ROS package."""
    assert text(manifest, "name") == setup_arguments["name"] == "xy_sysid"
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert text(manifest, "version") == setup_arguments["version"] == citation["version"]
    assert text(manifest, "license") == setup_arguments["license"] == "Apache-2.0"
    (maintainer,) = manifest.findall("maintainer")
    assert maintainer.get("email") == setup_arguments["maintainer_email"]
    assert re.fullmatch(r"[-\w.%+]+@[-\w%]+(\.[-\w%]+)+", maintainer.get("email") or "")
    assert manifest.get("format") == "3"
    assert manifest.findtext("export/build_type") == "ament_python"


def test_ros_tools_accept_the_manifest_and_find_where_to_ask(setup_arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    """catkin_pkg, used by colcon and rosdep, reads it without a warning; website, repository and bugtracker are those for pip.

    The domain of the maintainer's address is not one of those reserved for examples (RFC 2606).
    """
    package = pytest.importorskip("catkin_pkg.package", reason="catkin_pkg comes with the extra [test]")
    complaints: list[str] = []
    found = package.parse_package(str(ROOT / "package.xml"), warnings=complaints)
    found.validate(warnings=complaints)
    assert not complaints
    assert not re.search(r"(^|\.)(example|invalid|test|localhost)(\.|$)", found.maintainers[0].email.partition("@")[2])
    urls = {node.get("type"): node.text for node in manifest.findall("url")}
    told = {"website": setup_arguments["url"], **{name.lower(): place for name, place in setup_arguments["project_urls"].items()}}
    assert urls == told and set(urls) == {"website", "repository", "bugtracker"}


def test_every_dependency_has_a_rosdep_key_or_a_word_about_it(setup_arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    """All requirements of pip are in package.xml with their rosdep keys; those without a key are in a comment."""
    keys = {node.text for node in manifest.findall("exec_depend")}
    remarks = (ROOT / "package.xml").read_text(encoding="utf-8")
    for requirement in setup_arguments["install_requires"]:
        name = (
            re.split(r"[<>=;\[ ]", requirement)[0].lower().removeprefix("py") if requirement == "pyyaml" else re.split(r"[<>=;\[ ]", requirement)[0]
        )
        assert {f"python3-{name}", f"python3-{name}-pip"} & keys or f"{name} has no rosdep key" in remarks, requirement


def test_the_versions_of_everything_are_pinned(setup_arguments: dict[str, Any]) -> None:
    """constraints.txt has exact versions only, no options or hosts, and every requirement of every extra is in it."""
    lines = [line for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    pinned = {}
    for line in lines:
        assert re.fullmatch(r"[a-z0-9-]+==[\w.!+]+", line), line
        pinned[line.split("==")[0]] = line.split("==")[1]
    assert len(pinned) == len(lines)
    wanted = [*setup_arguments["install_requires"], *(item for extra in setup_arguments["extras_require"].values() for item in extra)]
    for requirement in wanted:
        name = re.split(r"[<>=;\[ ]", requirement)[0].lower().replace("_", "-")
        assert name in pinned, requirement
        exact = re.search(r"==([\d.]+)", requirement)
        assert exact is None or pinned[name] == exact.group(1)


def test_entry_points_lead_to_a_main_function(setup_arguments: dict[str, Any]) -> None:
    """Every executable names a module of this tree with a main function."""
    scripts = dict(item.split(" = ") for item in setup_arguments["entry_points"]["console_scripts"])
    assert {"xy-sysid", "excitation", "identifier", "diagnoser", "recorder", "ballscrew"} == set(scripts)
    for name, target in scripts.items():
        module, _, function = target.partition(":")
        path = ROOT / module.replace(".", "/")
        source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        assert source.is_file(), f"{name}: {source} is not there"
        tree = ast.parse(source.read_text(encoding="utf-8"))
        defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        defined |= {target.id for node in tree.body if isinstance(node, ast.Assign) for target in node.targets if isinstance(target, ast.Name)}
        defined |= {alias.asname or alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
        assert function in defined, f"{name}: {source} has no {function}"


def test_share_holds_the_marker_the_manifest_the_configuration_and_the_launch_files(setup_arguments: dict[str, Any]) -> None:
    """Files that ros2 launch, ros2 run and the nodes need in an installation."""
    data = {target: set(files) for target, files in setup_arguments["data_files"]}
    assert data["share/ament_index/resource_index/packages"] == {"resource/xy_sysid"}
    assert data["share/xy_sysid"] == {"package.xml"}
    assert {"config/default.yaml", "config/demo.yaml", "config/real.yaml", "config/fastdds.xml"} <= data["share/xy_sysid/config"]
    assert data["share/xy_sysid/config/machines"] == {f"config/machines/{path.name}" for path in (ROOT / "config" / "machines").glob("*.yaml")}
    assert data["share/xy_sysid/launch"] == {"launch/xy.launch.py"}
    for file in set().union(*data.values()):
        assert (ROOT / file).is_file(), file


def test_hooks_and_the_check_script_use_what_make_installs() -> None:
    """pre-commit fetches nothing: every hook is local; .ci/run is strict and calls make test."""
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    assert {repo["repo"] for repo in hooks["repos"]} == {"local"}
    assert {hook["language"] for repo in hooks["repos"] for hook in repo["hooks"]} == {"system"}
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    assert "set -euo pipefail" in script.read_text(encoding="utf-8")
    assert "make test" in script.read_text(encoding="utf-8")


def test_the_check_script_tests_as_a_fresh_machine_would(tmp_path: Path) -> None:
    """make test removes variables that change Python's behaviour: unbuffered output has hidden a fault before."""
    for name in ("make", "chromium"):
        (tmp_path / name).write_text("#!/bin/sh\necho $0 $@\nenv\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    odd = {"PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1", "LANG": "de_DE.UTF-8", "LC_ALL": "C", "KEPT": "yes"}
    around = {**os.environ, **odd, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    said = subprocess.run([ROOT / ".ci" / "run"], env=around, capture_output=True, text=True, check=True, timeout=60).stdout.splitlines()
    assert said[0] == f"{tmp_path / 'make'} test"
    seen = {line.partition("=")[0] for line in said[1:]}
    assert "KEPT" in seen and not {name for name in seen if name.startswith(("PYTHON", "LC_")) or name == "LANG"}


def test_the_pythons_that_are_promised_are_the_same_everywhere(setup_arguments: dict[str, Any]) -> None:
    """setup.py, the Makefile and the docs name 3.11, 3.12 and 3.13."""
    assert setup_arguments["python_requires"] == ">=3.11,<3.14"
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "(3, 11) <= sys.version_info[:2] < (3, 14)" in makefile and "no Python 3.11, 3.12 or 3.13 with venv" in makefile
    for name in ("README.md", "docs/quick-start.md"):
        assert "Python 3.11, 3.12 or 3.13" in (ROOT / name).read_text(encoding="utf-8"), name


def test_a_busy_machine_can_be_made_and_ends_with_the_test() -> None:
    """make test-busy runs the tests together with busy processes, and ends these."""
    with busy(3) as numbers:
        assert len(numbers) == 3 and all(Path(f"/proc/{number}").exists() for number in numbers)
    assert not any(Path(f"/proc/{number}").exists() for number in numbers)


def test_the_launch_file_starts_the_executables_and_moves_nothing_unasked(setup_arguments: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins for launch: each node is an executable of the package, and activation is off by default."""
    made: list[tuple[str, dict[str, Any]]] = []

    class StandIn(types.ModuleType):
        def __getattr__(self, name: str) -> Any:
            if name.startswith("__"):
                raise AttributeError(name)

            def make(*arguments: Any, **keywords: Any) -> Any:
                made.append((name, {"arguments": arguments, **keywords}))
                return made[-1]

            vars(make).update(TRANSITION_ACTIVATE=3, TRANSITION_CONFIGURE=1)
            return make

    tree = ast.parse((ROOT / "launch" / "xy.launch.py").read_text(encoding="utf-8"))
    for name in {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}:
        for end in [*(index for index, letter in enumerate(name) if letter == "."), len(name)]:
            monkeypatch.setitem(sys.modules, name[:end], StandIn(name[:end]))
    runpy.run_path(str(ROOT / "launch" / "xy.launch.py"))["generate_launch_description"]()
    scripts = {item.split(" = ")[0] for item in setup_arguments["entry_points"]["console_scripts"]}
    nodes = [keywords for kind, keywords in made if kind in ("Node", "LifecycleNode")]
    assert {node["executable"] for node in nodes} == scripts - {"xy-sysid"}
    assert all(node["package"] == "xy_sysid" for node in nodes)
    declared = {keywords["arguments"][0]: keywords["default_value"] for kind, keywords in made if kind == "DeclareLaunchArgument"}
    assert declared["activate"] == declared["simulate"] == declared["record"] == "false"
    (driven,) = [keywords["parameters"][-1] for keywords in nodes if keywords["executable"] == "excitation"]
    assert set(driven) == {"autostart"} and driven["autostart"][1]["arguments"] == ("activate",)
    assert not any("autostart" in item for keywords in nodes if keywords["executable"] != "excitation" for item in keywords.get("parameters", []))
    (asked,) = [keywords for kind, keywords in made if kind == "EmitEvent"]
    assert asked["event"][1]["transition_id"] == 1 and asked["condition"][0] == "UnlessCondition"  # configure, and never activate


def test_the_package_and_not_its_clone_is_imported_beside_the_clone(tmp_path: Path) -> None:
    """Python in the folder above a clone named xy_sysid imports the package, not an empty namespace."""
    (tmp_path / "xy_sysid").symlink_to(ROOT)
    words = "import xy_sysid; print(xy_sysid.__version__)"
    said = subprocess.run([sys.executable, "-c", words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    assert said.stdout.strip()
