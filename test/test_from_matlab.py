"""docs/from-matlab.md: every line of our commands runs, in the order of the page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from helpers import ROOT

PAGE = (ROOT / "docs" / "from-matlab.md").read_text(encoding="utf-8")
LINES = re.findall(r"^\| [^|]+ \| `([^`]+)` \| [^|]+ \|$", PAGE, re.MULTILINE)


def test_every_line_beside_matlab_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """First the data of the page, then the middle column of each table."""
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {}
    exec(PAGE.split("```python\n")[1].split("```")[0], scope)
    scipy.io.savemat("rec.mat", {"x_voltage": np.asarray(scope["u"]), "x_position": np.asarray(scope["y"])})
    assert len(LINES) == sum(line.startswith("| ") for line in PAGE.splitlines()) - PAGE.count("| MATLAB |")
    for line in LINES:
        exec(line, scope)
    assert {"run", "frf", "model", "simple", "refined", "found"} <= set(scope)
    assert (tmp_path / "refined.yaml").is_file()
