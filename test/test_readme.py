"""Every code block of README runs, in its order, in one empty folder, and then what the quick start goes on with."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOT_RUN = ("git clone", "axis x")  # the way to the program itself (test_packaging), an answer
GOES_ON = "## The same in a notebook"  # from here on the quick start uses what README has made


def blocks(text: str) -> list[str]:
    """Indented blocks after an empty line."""
    found = re.findall(r"(?<=\n\n)((?:    .*\n|\n(?=    ))+)", text)
    return [textwrap.dedent(block).strip() for block in found]


def test_every_block_of_the_readme_runs_in_order_in_an_empty_folder(tmp_path: Path) -> None:
    """A newcomer copies one after the other: each ends well, and none destroys what an earlier one made."""
    bare = {name: os.environ[name] for name in ("HOME", "LANG", "TMPDIR") if name in os.environ}
    bare["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = {"shell": 0, "notebook": 0}
    readme, quick = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/quick-start.md"))
    for block in blocks(readme) + blocks(quick[quick.index(GOES_ON) :]):
        if block.startswith(NOT_RUN):
            continue
        before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
        if block.startswith("import xy_sysid"):
            ran["notebook"] += 1
            shown = "import plotly.io; plotly.io.renderers.default = ''\n"  # a notebook without a screen
            done = subprocess.run([sys.executable, "-c", shown + block], cwd=tmp_path, env=bare, capture_output=True, text=True, check=False)
        else:
            assert all(line.startswith("xy-sysid ") for line in block.splitlines()), f"what is this? {block}"
            ran["shell"] += 1
            done = subprocess.run(["bash", "-e", "-c", block], cwd=tmp_path, env=bare, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{block}\n{done.stdout}\n{done.stderr}"
        assert "Traceback" not in done.stderr
        for path, content in before.items():
            assert path.read_bytes() == content, f"{path.name} was overwritten by\n{block}"
    assert ran["shell"] >= 2 and ran["notebook"] == 2


def test_what_is_saved_in_a_notebook_may_be_saved_again() -> None:
    """Restart and run all: no cell of README, of the quick start or of an example refuses because of its own file from the run before."""
    pages = [ROOT / "README.md", ROOT / "docs" / "quick-start.md", *(ROOT / "docs" / "examples").glob("*.py")]
    saved = [line.strip() for page in pages for line in page.read_text(encoding="utf-8").splitlines() if "xy.save(" in line]
    assert len(saved) >= 4 and [line for line in saved if "force=True" not in line] == []
