"""docs/api.md: its examples run in their order, and use all public names but a few."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from helpers import ROOT

import xy_sysid as xy

PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
NEEDS_MORE = {
    "FrequencyResponse",
    "LinearModel",
    "Run",
    "servo",
    "to_control",
    "XySysidError",
    "MissingExtra",
    "plot",
}  # results, extras, a servo's log
LONG = "print(xy.next_experiment(found, limits).sentence)\n"  # test_of_run and docs/settle.md run it


def test_every_example_of_the_public_names_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """In an empty folder, in the order of the page; the hidden friction is found, its gain is printed, and an error is one line."""
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {}
    for block in BLOCKS:
        exec(block.replace(LONG, ""), scope)
    said = capsys.readouterr().out
    assert "Missing: coulomb_friction." in said and "nothing.csv: cannot be read" in said
    assert {"rec.csv", "table", "bode.html", "residual.html", "ladder.html", "axis.yaml", "report.html"} <= {path.name for path in tmp_path.iterdir()}


def test_every_public_name_has_an_example() -> None:
    """Those of results and errors stand in the text below."""
    text = "".join(BLOCKS)
    missing = {name for name in xy.__all__ if name != "__version__" and not re.search(rf"xy\.{name}\b", text)}
    assert missing <= NEEDS_MORE, missing - NEEDS_MORE
