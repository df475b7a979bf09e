"""Numbers in two places of the documentation are equal."""

from __future__ import annotations

import re

import numpy as np
from helpers import ROOT

PAGE, USE = (ROOT / "docs" / name for name in ("real-machines.md", "use.md"))


def rows(name: str) -> list[list[str]]:
    """The cells of a benchmark's table, without its heading."""
    part = PAGE.read_text(encoding="utf-8").split(f"<!-- made by python -m campaigns.bench {name} -->")[1].split(f"<!-- end of {name} -->")[0]
    lines = [line for line in part.splitlines() if line.startswith("| ") and "---" not in line]
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[1:]]


def test_two_tables_of_real_machines_tell_the_same_error_of_the_same_recording() -> None:
    """The rigid model of ``diagnose`` is that of the comparison with plain least squares: same windows, same number."""
    found = {row[0]: row[5].partition(" to ")[0] for row in rows("diagnoses") if row[5]}
    compared = {row[0]: row[2] for row in rows("peers") if row[1] == "rigid"}
    both = found.keys() & compared.keys()
    assert len(both) > 5 and {name: found[name] for name in both} == {name: compared[name] for name in both}


def test_the_words_below_the_campaign_of_use_tell_its_table() -> None:
    """Medians in per cent, the axes that reach both goals, and those that an own PID follows better; each axis named below has the named effect."""
    table, words = USE.read_text(encoding="utf-8").split("What the table says:")
    words = " ".join(words.split("\n## ")[0].split())
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if re.match(r"\| (MuJoCo )?9\d\d\d ", line)]
    pid, simple, best, own = np.array([row[4:] for row in cells], dtype=float).T
    medians = (float(np.median(best / pid)), float(np.median(best / simple)))
    assert f"to {100 * medians[0]:.1f} % of that of the PID, and to {100 * medians[1]:.0f} % of that with kS, kV and kA" in words
    both = int(np.sum((best <= pid / 10.0) & (best <= simple / 3.0)))
    assert f"hold for {both} of {len(cells)} axes taken one by one" in words
    assert f"better on {int(np.sum(own <= best))} of the {len(cells)} axes" in words
    hidden = {row[0].removeprefix("MuJoCo ").removesuffix(" x") if "MuJoCo" in row[0] else row[0]: row[1] for row in cells}
    said = re.findall(r"\*\*(?:A MuJoCo joint with )?([A-Z]\w+)(?: \w+)?\*\* \((9[^)]*)\)", words)
    assert {name for name, _ in said} == {"Backlash", "Stribeck", "Dead", "Coulomb"}
    for name, axes in said:
        assert all(name.lower() in hidden[axis] for axis in axes.split(", ")), (name, axes)
    (joint,) = re.findall(r"\(9206\).*?the error is ([\d.]+) urad", words)
    assert float(joint) == next(float(row[6]) for row in cells if row[0] == "MuJoCo 9206 x")
