"""The scripts of the gallery run unchanged, in an empty folder."""

from __future__ import annotations

import contextlib
import io
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers import ROOT
from helpers.real_data import data

EXAMPLES = ROOT / "docs" / "examples"


def run(name: str, folder: Path, *arguments: object) -> str:
    """Output of a script run in this process; its errors are raised."""
    out, words = io.StringIO(), sys.argv
    sys.argv = [name, *map(str, arguments)]
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(out):
            runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    finally:
        sys.argv = words
    return out.getvalue()


def test_the_gallery_shows_every_example() -> None:
    """Each script has a link, and each link a script."""
    told = re.findall(r"\]\(examples/(\w+\.py)\)", (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8"))
    assert sorted(told) == sorted(path.name for path in EXAMPLES.glob("*.py"))


def test_a_hidden_effect_is_named_and_the_error_falls_to_the_floor(tmp_path: Path) -> None:
    """Cogging, as in README; a figure and a model are written."""
    said = run("hidden_effect.py", tmp_path)
    assert "Missing: cogging" in said
    last = re.findall(r"([\d.]+) mm/s, floor ([\d.]+)", said)[-1]
    assert float(last[0]) < 1.1 * float(last[1])
    assert (tmp_path / "ladder.html").is_file() and (tmp_path / "axis_x.yaml").is_file()


def test_a_csv_gives_a_transfer_function(tmp_path: Path) -> None:
    """Millimetres are converted with a note; every parameter has an interval."""
    said = run("own_csv.py", tmp_path)
    assert "is converted from mm to m" in said and re.search(r"resonance.*Hz", said)
    assert run("own_csv.py", tmp_path, "mine.csv") == said


def test_an_effect_of_ones_own_is_fitted(tmp_path: Path) -> None:
    """The file of docs/your-own-effect.md; its coefficient is recovered."""
    page = (ROOT / "docs" / "your-own-effect.md").read_text(encoding="utf-8")
    (tmp_path / "mains_hum.py").write_text(page.split("```python\n")[1].split("```")[0], encoding="utf-8")
    said = run("own_effect.py", tmp_path)
    found = float(re.findall(r"^mains_hum.amplitude\s+([\d.e+-]+)", said, re.MULTILINE)[0])
    assert found == pytest.approx(0.5, rel=0.05)


def test_bags_of_two_days_are_compared(tmp_path: Path) -> None:
    """The model still holds for the same machine."""
    said = run("bag.py", tmp_path)
    assert said.count("the model holds") == 2


def test_emps_is_diagnosed_where_its_data_are(tmp_path: Path) -> None:
    """Without the data it says where to get them, in one line."""
    with pytest.raises(SystemExit, match=r"^emps_train.npz is not here: see docs/real-data.md for where to get it.$"):
        run("emps.py", tmp_path)
    with np.load(data("emps/emps_train.npz")) as kept:
        brief = {name: values[: len(kept["t"]) // 3] if values.shape[:1] == kept["t"].shape else values for name, values in kept.items()}
    np.savez(tmp_path / "brief.npz", **brief)
    assert "friction" in run("emps.py", tmp_path, tmp_path / "brief.npz")
