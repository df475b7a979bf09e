"""docs/use.md and the tutorial: their commands run and give the stated numbers, and their tables are complete."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from helpers import ROOT
from helpers.cli_tools import cli

from xy_sysid.control_design.exports import TARGETS

PAGE, TUTORIAL = (ROOT / "docs" / name for name in ("use.md", "csv-to-numbers.md"))


def test_the_table_of_exports_names_every_target() -> None:
    """Every target is in the table, and every one in the table exists."""
    told = re.findall(r"^\| `(\w+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(told) == sorted(TARGETS)


def test_the_tutorial_leads_from_a_csv_to_pasted_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its script and its commands run in order; kS, kV and kA are the stated ones, to three digits."""
    monkeypatch.chdir(tmp_path)
    page = TUTORIAL.read_text(encoding="utf-8")
    exec(page.split("```python\n")[1].split("```")[0], {})
    walk = [line.split()[1:] for line in page.splitlines() if line.startswith("    xy-sysid ")]
    assert [words[0] for words in walk] == ["refine", "use", "use", "use"]
    said = [cli(*words) for words in walk]
    assert [one.code for one in said] == [0, 0, 0, 0], said
    shown, found = (dict(re.findall(r"^ *(k[SVA]) +([\d.]+) ", text, re.MULTILINE)) for text in (page, said[1].out))
    assert set(shown) == {"kS", "kV", "kA"}
    for name, value in shown.items():
        assert float(found[name]) == pytest.approx(float(value), rel=1e-3), name
    assert "setp pid.x.FF1" in said[2].out and "dof_names: ['x']" in said[3].out
