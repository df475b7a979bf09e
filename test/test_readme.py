"""Every code block of README runs, in order, in one empty folder, followed by those of the quick start."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

import plotly.io
import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import Said, cli

NOT_RUN = ("git clone", "axis x")  # the installation (test_packaging), an output
GOES_ON = "## The same in a notebook"  # from here on the quick start uses the files of README


def blocks(text: str) -> list[str]:
    """Indented blocks after an empty line."""
    found = re.findall(r"(?<=\n\n)((?:    .*\n|\n(?=    ))+)", text)
    return [textwrap.dedent(block).strip() for block in found]


@dataclass(frozen=True)
class Walk:
    """The result of all blocks in sequence: the folder, the output of each command, and overwritten files."""

    folder: Path
    said: dict[str, Said]
    notebooks: int
    overwritten: list[str]


def installed(words: list[str], folder: Path) -> Said:
    """The command as a process with only a PATH, which finds the installation."""
    bare = {name: os.environ[name] for name in ("HOME", "LANG", "TMPDIR") if name in os.environ}
    bare["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(words, cwd=folder, env=bare, capture_output=True, text=True, check=False)
    return Said(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Walk:
    """compare in a separate process; the other commands and the notebooks in this one."""
    made = Walk(tmp_path_factory.mktemp("walk"), {}, 0, [])
    readme, quick = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/quick-start.md"))
    notebooks, shown = 0, plotly.io.renderers.default
    plotly.io.renderers.default = ""  # a notebook without a screen
    try:
        with contextlib.chdir(made.folder):
            for block in blocks(readme) + blocks(quick[quick.index(GOES_ON) :]):
                notebook = block.startswith("import xy_sysid")
                notebooks += notebook
                for part in () if block.startswith(NOT_RUN) else [block] if notebook else block.splitlines():
                    before = {path: path.read_bytes() for path in made.folder.rglob("*") if path.is_file()}
                    if notebook:
                        exec(compile(part, "notebook", "exec"), {})
                    else:
                        words = part.split("#")[0].split()
                        assert words[0] == "xy-sysid", f"what is this? {part}"
                        said = installed(words, made.folder) if words[1] == "compare" else cli(*words[1:])
                        assert said.code == 0, (part, said)
                        made.said[words[1]] = made.said.get(words[1], said)
                    made.overwritten.extend(f"{path.name} by {part}" for path, content in before.items() if path.read_bytes() != content)
    finally:
        plotly.io.renderers.default = shown
    return Walk(made.folder, made.said, notebooks, made.overwritten)


def test_every_block_of_the_readme_runs_in_order_in_an_empty_folder(walk: Walk) -> None:
    """The commands in sequence: each succeeds, and none overwrites the file of an earlier one."""
    assert walk.overwritten == []
    assert set(walk.said) >= {"simulate", "compare", "diagnose", "refine", "fit", "validate"} and walk.notebooks == 2
    assert not any("Traceback" in said.err for said in walk.said.values())


def test_four_commands_lead_from_a_hidden_effect_to_the_noise_floor(walk: Walk) -> None:
    """The commands of README, unchanged: each answers with the printed names, and the final error is at the floor."""
    part = (ROOT / "README.md").read_text(encoding="utf-8").split("## What is missing? Four commands")[1].split("\n## ")[0]
    assert re.findall(r"^    xy-sysid (\w+)", part, re.MULTILINE) == ["simulate", "compare", "diagnose", "refine"] == list(walk.said)[:4]
    for axis in ("x", "y"):
        assert re.search(rf"axis {axis}: the error is [\d.]+ times the noise floor", walk.said["compare"].out)
    left = r"\. It explains 100 % of the error's power \(([\d.]+) -> ([\d.]+) mm/s\)\. "
    left += r"The residual error is at the noise floor \(([\d.]+) mm/s\)"
    shown = re.findall(r"^    (axis \w+: Missing: \w+)" + left, part, re.MULTILINE)
    assert len(shown) == 2
    for sentence, *figures in shown:
        found = re.search(re.escape(sentence) + left, walk.said["diagnose"].out)
        assert found is not None, walk.said["diagnose"].out
        assert [float(value) for value in found.groups()] == pytest.approx([float(value) for value in figures], rel=0.05)
    model = yaml.safe_load((walk.folder / "axes.yaml").read_text(encoding="utf-8"))
    for axis in ("x", "y"):
        assert model["axes"][axis]["held_out_error"] < 1.05 * model["axes"][axis]["noise_floor"]
    assert walk.said["refine"].out.count("the held-out error is at the noise floor") == 2


def test_what_is_saved_in_a_notebook_may_be_saved_again() -> None:
    """Restart and run all: no cell of README, of the quick start or of an example fails because of its file from the previous run."""
    pages = [ROOT / "README.md", ROOT / "docs" / "quick-start.md", *(ROOT / "docs" / "examples").glob("*.py")]
    saved = [line.strip() for page in pages for line in page.read_text(encoding="utf-8").splitlines() if "xy.save(" in line]
    assert len(saved) >= 4 and [line for line in saved if "force=True" not in line] == []
