"""Numbers in two places of the documentation are equal."""

from __future__ import annotations

from helpers import ROOT

PAGE = ROOT / "docs" / "real-machines.md"


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
