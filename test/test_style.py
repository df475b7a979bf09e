"""Rules of the source: allowed imports, limits of the core, and forbidden content of files."""

from __future__ import annotations

import ast
import fnmatch
import functools
import graphlib
import re
import subprocess
from pathlib import Path

import pytest
from helpers import ROOT

import xy_sysid


def names(text: str) -> list[str]:
    """The words of a table."""
    return text.split()


# Upstream first, in the order of the data: a file imports from its own package and from earlier ones.
CORE = names("""
errors units settings jit tables
samples excitation
response linear fitting time_models
effects axis greybox comparison hypotheses diagnosis experiment_design
story live control_design
""")
EDGE = names("""
bags imports files processes fleets
nodes report paper page front_door cli
""")
ORDER = [*CORE, *EDGE]
ALONE = {"__init__", "__main__", "errors", "settings", "units", "jit", "tables"}  # files next to the packages

NOT_IN_CORE = names("""
rclpy std_msgs sensor_msgs diagnostic_msgs rosbags typer rich plotly yaml
pathlib os io sys shutil tempfile subprocess socket logging time datetime threading multiprocessing asyncio random
""")
NOT_CALLED_IN_CORE = {"print", "open", "input", "exec", "eval"}
SHARED_WITH_THE_MACHINE = {"xy_sysid.jit", "xy_sysid.errors", "xy_sysid.samples.block", "xy_sysid.settings", "xy_sysid.bags.opening"}


@functools.cache
def sources(package: str) -> list[Path]:
    return sorted(path for path in (ROOT / package).rglob("*.py") if "__pycache__" not in path.parts)


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@functools.cache
def imported(path: Path) -> set[str]:
    """Full names of all imports of a file, at any place, except for type checking."""
    found: set[str] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                here = ROOT / full.replace(".", "/")
                found.add(full if here.is_dir() or here.with_suffix(".py").is_file() else str(node.module))
    return found


def place_of(module: str) -> str:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else ""


def test_a_file_imports_only_from_upstream() -> None:
    """Reading order = data order = import order. Only ``__init__`` and ``__main__`` may import everything."""
    wrong = []
    for path in sources("xy_sysid"):
        place = place_of(module_of(path))
        if place in ("", "__main__"):
            continue
        assert place in ORDER, f"a new package, {place!r}: say in this test what stands before it"
        for name in imported(path):
            if name.split(".")[0] == "xy_sysid" and place_of(name) not in ("", place) and ORDER.index(place_of(name)) > ORDER.index(place):
                wrong.append(f"{module_of(path)} imports {name}, which is downstream")
            if name.split(".")[0] == "xy_sim" and place not in ("cli", "nodes", "front_door"):
                wrong.append(f"{module_of(path)} imports {name}: hypotheses must not know the machine")
    assert not wrong


def test_only_what_everybody_knows_stands_beside_the_packages() -> None:
    """Everything else is in a package; a package is a folder with a docstring about its content."""
    assert {path.stem for path in (ROOT / "xy_sysid").glob("*.py")} == ALONE
    packages = {path.parent.name: ast.get_docstring(tree_of(path)) for path in (ROOT / "xy_sysid").glob("*/__init__.py")}
    assert sorted([*packages, *ALONE]) == sorted({*ORDER, *ALONE})
    for name in packages:
        assert packages[name], f"xy_sysid/{name}/__init__.py says nothing"


def test_the_core_knows_no_ros_no_files_no_clock_and_does_not_print() -> None:
    """Data, time and randomness are arguments of the core, which never reads them itself."""
    wrong: dict[str, set[str]] = {}
    for path in [path for path in sources("xy_sysid") if place_of(module_of(path)) in CORE]:
        calls = {node.func.id for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
        touched = {name.split(".")[0] for name in imported(path)} & set(NOT_IN_CORE) | calls & NOT_CALLED_IN_CORE
        wrong |= {module_of(path): touched} if touched else {}
    assert not wrong


def test_the_simulated_machine_shares_no_physics_with_the_identification() -> None:
    """Independent truth: except for its nodes, xy_sim imports only tools from xy_sysid."""
    for path in sources("xy_sim"):
        taken = {name for name in imported(path) if name.split(".")[0] == "xy_sysid"}
        assert path.name in ("node.py", "ballscrew_node.py", "controller_node.py", "trajectory_node.py") or taken <= SHARED_WITH_THE_MACHINE, path


def test_no_import_goes_in_a_circle() -> None:
    """The graph of explicit imports of both packages has an order."""
    graph = {module_of(path): imported(path) - {module_of(path)} for path in [*sources("xy_sysid"), *sources("xy_sim")]}
    try:
        order = list(graphlib.TopologicalSorter(graph).static_order())
    except graphlib.CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))
    assert set(graph) <= set(order)


def _classes(path: Path) -> list[str]:
    """Public classes and named types of a file."""
    found = [node.name for node in tree_of(path).body if isinstance(node, ast.ClassDef)]
    for node in tree_of(path).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found.append(node.targets[0].id)
    return [name for name in found if name[0].isupper() and not name.isupper() and "_" not in name]


def test_slow_parts_of_scipy_are_loaded_when_they_are_first_used() -> None:
    """``import scipy`` is enough: scipy.signal and scipy.stats take a second, and most commands and nodes do not need them."""
    slow = re.compile(r"^(import|from) scipy\.(signal|stats|optimize)\b|^from scipy import", re.MULTILINE)
    assert [str(path) for path in sources("xy_sysid") if slow.search(path.read_text(encoding="utf-8"))] == []


def test_no_public_class_name_stands_for_two_things_in_the_core() -> None:
    """One name, one meaning: a public name is unique in the package."""
    where: dict[str, list[str]] = {}
    for path in sources("xy_sysid"):
        if place_of(module_of(path)) in CORE:
            for name in _classes(path):
                where.setdefault(name, []).append(module_of(path))
    twice = {name: homes for name, homes in where.items() if len(homes) > 1}
    assert not twice


def _fields(path: Path) -> dict[str, int]:
    """Number of fields of each dataclass of a file."""
    found = {}
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ClassDef) and any("dataclass" in ast.unparse(item) for item in node.decorator_list):
            found[node.name] = sum(isinstance(item, ast.AnnAssign) for item in node.body)
    return found


def test_what_has_more_than_four_fields_is_built_by_keyword() -> None:
    """Up to four values may be positional; more must be named. Effects may have tables of their parameters."""
    large = {name for path in sources("xy_sysid") for name, fields in _fields(path).items() if fields > 4} - {"Parameter"}
    wrong = []
    for path, node in [(file, node) for file in sources("xy_sysid") for node in ast.walk(tree_of(file))]:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in large:
            unnamed = len(node.args) + sum(isinstance(item, ast.Starred) for item in node.args)
            wrong += [f"{path.name}:{node.lineno}: {node.func.id} of {unnamed} unnamed values"] if unnamed > 4 else []
    assert not wrong


def _parameters(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    every = [*node.args.posonlyargs, *node.args.args, *(() if node.name in xy_sysid.__all__ else node.args.kwonlyargs)]
    return sum(item.arg not in ("self", "cls") for item in every)


def test_a_function_has_at_most_six_parameters() -> None:
    """Exceptions: kernels with separate numbers, options of a command, and keywords of a public function."""
    wrong = []
    for path in [path for path in [*sources("xy_sysid"), *sources("xy_sim")] if not module_of(path).startswith("xy_sysid.cli.")]:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not any(_kernel(item) for item in node.decorator_list):
                count = _parameters(node)
                wrong += [f"{path.name}:{node.lineno}: {node.name} has {count} parameters"] if count > 6 else []
    assert not wrong


def _kernel(decorator: ast.expr) -> bool:
    return isinstance(decorator, ast.Name) and decorator.id in ("compiled", "law", "inner", "inlined")


def test_tests_share_helpers_and_never_each_other() -> None:
    """A test can be read, moved and run alone; shared code is in test/helpers."""
    for path in sources("test"):
        taken = {name.split(".")[0] for name in imported(path)}
        assert not [name for name in taken if name.startswith("test_")], path


EVERYWHERE = ("xy_sysid", "xy_sim", "campaigns", "test")


def test_nothing_silences_the_type_checker() -> None:
    """A wrong type is fixed, not suppressed."""
    for path in [path for place in EVERYWHERE for path in sources(place)]:
        assert "type: " + "ignore" not in path.read_text(encoding="utf-8"), path


def test_nothing_catches_every_exception() -> None:
    """No bare except, no except Exception."""
    for path in [*sources("xy_sysid"), *sources("xy_sim")]:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ExceptHandler):
                assert node.type is not None, f"{path}:{node.lineno}"
                caught = {part.id for part in ast.walk(node.type) if isinstance(part, ast.Name)}
                assert not caught & {"Exception", "BaseException"} or _raises(node), f"{path}:{node.lineno}"


def _raises(handler: ast.ExceptHandler) -> bool:
    return any(isinstance(node, ast.Raise) and node.exc is None for node in ast.walk(handler))


def test_no_file_names_a_host_to_install_from_or_a_path_of_one_machine() -> None:
    """A clone works anywhere: packages come from pip's configured index."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git clone")
    forbidden = re.compile(
        r"https?://[\w.-]*(?:pypi|pythonhosted|registry|mirror|proxy)[\w.-]*|--(?:extra-)?index-url|(?<![\w.])/(?:work|root|home)/\w"
    )
    for name in listed.stdout.decode().split("\0"):
        path = ROOT / name
        if not name or path == Path(__file__) or not path.is_file():
            continue
        text = path.read_bytes().decode("utf-8", "replace")
        found = forbidden.search(text)
        assert found is None, f"{name}, line {text[: found.start()].count(chr(10)) + 1}: {found.group()}"


def test_the_docstring_of_a_package_lists_its_modules() -> None:
    """A list names every module of its folder, and nothing else. Effects list only their shared tools."""
    wrong = []
    for path in sources("xy_sysid"):
        text = ast.get_docstring(tree_of(path)) if path.name == "__init__.py" else None
        body = (text or "").partition("\n")[2]
        listed = {name for line in re.findall(r"^ *(\w[\w*]*(?:, \w[\w*]*)*): +\S", body, re.MULTILINE) for name in line.split(", ")}
        if not listed:
            continue
        inside = [one.relative_to(path.parent) for one in sources("xy_sysid") if one.is_relative_to(path.parent)]
        there = {one.parts[0].removesuffix(".py") for one in inside}
        said = [] if path.parent.name == "effects" else re.findall(r"[\w*]+", body)
        missing = {name for name in there if said and name[0] != "_" and not any(fnmatch.fnmatchcase(name, word) for word in said)}
        wrong += [f"{path.parent.name}: {name}" for name in sorted(missing | {name for name in listed if not fnmatch.filter(there, name)})]
    assert not wrong
