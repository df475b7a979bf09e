"""The shape of the source: who may import whom, what the core must not touch, and what must not be in a file."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def names(text: str) -> list[str]:
    """The words of a table."""
    return text.split()


# Upstream first: a file imports only from names to its left or above it, or from its own folder.
CORE = names("""
errors compiled stream hold settings recording frf transfer_function
excitation travel drive pacing
simulation reduction
windows window_check period friction_hint spectra batch estimate
fitting orders validation model_check tracking
noise_floor effects swing between effect_loop effect_code axis_kernel axis_model spectral_cost base_start velocity_fit traces inverse_start
own_units greybox open_loop one_step one_step_race comparison race ladder detours refinement diagnosis
ring pairing joints identifier messages live_fit replay offline
linear_part paired distortion findings story_pictures story story_document
hearing live_story diagnoser
""")
EDGE = names("""
shipped parameter_file settings_doc effects_doc tool_layouts user_effects run_plan starter
bags imports exports saved_models state_file work_queue story_worker
nodes
report page
cli __main__
""")
ORDER = [*CORE, *EDGE]

NOT_IN_CORE = names("""
rclpy std_msgs sensor_msgs diagnostic_msgs rosbags typer rich plotly yaml
pathlib os io sys shutil tempfile subprocess socket logging time datetime threading multiprocessing asyncio random
""")
NOT_CALLED_IN_CORE = {"print", "open", "input", "exec", "eval"}
SHARED_WITH_THE_MACHINE = {"compiled", "errors", "stream", "settings"}


def sources(package: str) -> list[Path]:
    return sorted(path for path in (ROOT / package).rglob("*.py") if "__pycache__" not in path.parts)


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imported(path: Path) -> set[str]:
    """Full names of all that a file imports, wherever in the file it does, save for type checking only."""
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


@pytest.mark.parametrize("path", sources("xy_sysid"), ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_imports_only_from_upstream(path: Path) -> None:
    """Reading order = data order = import order."""
    place = place_of(module_of(path))
    if not place:
        assert not {name for name in imported(path) if name.startswith("xy_")}
        return
    assert place in ORDER, f"{path.name} has no place in the order yet: add {place!r} to CORE or EDGE in this test"
    for name in imported(path):
        if name.split(".")[0] == "xy_sysid" and place_of(name) not in ("", place):
            assert ORDER.index(place_of(name)) < ORDER.index(place), f"{module_of(path)} imports {name}, which is downstream"
        if name.split(".")[0] == "xy_sim":
            assert place in ("cli", "nodes"), f"{module_of(path)} imports {name}: hypotheses must not know the machine"


@pytest.mark.parametrize(
    "path", [path for path in sources("xy_sysid") if place_of(module_of(path)) in CORE], ids=lambda path: str(path.relative_to(ROOT))
)
def test_the_core_knows_no_ros_no_files_no_clock_and_does_not_print(path: Path) -> None:
    """The core is told; it never asks: data, time and randomness are arguments."""
    touched = {name.split(".")[0] for name in imported(path)} & set(NOT_IN_CORE)
    assert not touched, f"{module_of(path)} imports {', '.join(sorted(touched))}"
    calls = {node.func.id for node in ast.walk(tree_of(path)) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    assert not calls & NOT_CALLED_IN_CORE


@pytest.mark.parametrize("path", sources("xy_sim"), ids=lambda path: str(path.relative_to(ROOT)))
def test_the_simulated_machine_shares_no_physics_with_the_identification(path: Path) -> None:
    """Never mark your own homework: apart from its node, xy_sim takes only tools from xy_sysid."""
    if path.name in ("node.py", "ballscrew_node.py"):
        return
    taken = {place_of(name) for name in imported(path) if name.split(".")[0] == "xy_sysid"}
    assert taken <= SHARED_WITH_THE_MACHINE


def test_no_import_goes_in_a_circle() -> None:
    """The graph of explicit imports of both packages has an order."""
    graph = {module_of(path): imported(path) - {module_of(path)} for path in [*sources("xy_sysid"), *sources("xy_sim")]}
    try:
        order = list(graphlib.TopologicalSorter(graph).static_order())
    except graphlib.CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))
    assert set(graph) <= set(order)


def test_nothing_catches_every_exception_or_silences_the_type_checker() -> None:
    """No bare except, no except Exception, no type: ignore."""
    for path in [*sources("xy_sysid"), *sources("xy_sim")]:
        assert "type: " + "ignore" not in path.read_text(encoding="utf-8"), path
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ExceptHandler):
                assert node.type is not None, f"{path}:{node.lineno}"
                caught = {part.id for part in ast.walk(node.type) if isinstance(part, ast.Name)}
                assert not caught & {"Exception", "BaseException"} or _raises(node), f"{path}:{node.lineno}"


def _raises(handler: ast.ExceptHandler) -> bool:
    return any(isinstance(node, ast.Raise) and node.exc is None for node in ast.walk(handler))


def test_no_file_names_a_host_to_install_from_or_a_path_of_one_machine() -> None:
    """A clone works anywhere: packages come from wherever pip is set up to look."""
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
