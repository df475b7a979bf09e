"""Every code block of README runs, in its order, in one empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOT_RUN = ("git clone", "axis x", "voltage, position")  # the way to the program itself (test_packaging), an answer, a diagram


def blocks(text: str) -> list[str]:
    """Indented blocks after an empty line."""
    found = re.findall(r"(?<=\n\n)((?:    .*\n|\n(?=    ))+)", text)
    return [textwrap.dedent(block).strip() for block in found]


def test_every_block_of_the_readme_runs_in_order_in_an_empty_folder(tmp_path: Path) -> None:
    """A newcomer copies one after the other: each ends well, and none destroys what an earlier one made."""
    bare = {name: os.environ[name] for name in ("HOME", "LANG", "TMPDIR") if name in os.environ}
    bare["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    ran = {"shell": 0, "notebook": 0}
    for block in blocks((ROOT / "README.md").read_text(encoding="utf-8")):
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
    assert ran["shell"] >= 2 and ran["notebook"] == 1
