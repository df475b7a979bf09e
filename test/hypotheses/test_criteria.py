"""The numbers that steer the search: all in one table, each with its reason."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from helpers import ROOT

from campaigns.documents.search import document
from xy_sysid.hypotheses import criteria

CRITERIA = ROOT / "xy_sysid" / "hypotheses" / "criteria.py"
STEERED = [path for package in ("hypotheses", "diagnosis") for path in sorted((ROOT / "xy_sysid" / package).glob("*.py")) if path != CRITERIA]


def bare_numbers(path: Path) -> list[str]:
    """Names of a module's numeric constants, except zeros."""
    found = []
    for item in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(item, ast.Assign):
            targets, value = item.targets, item.value
        elif isinstance(item, ast.AnnAssign) and item.value is not None:
            targets, value = [item.target], item.value
        else:
            continue
        if any(isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value for node in ast.walk(value)):
            found += [ast.unparse(target) for target in targets]
    return found


def test_each_number_has_a_name_of_its_own() -> None:
    """Each name has one meaning."""
    names = [row.name for row in criteria.TABLE]
    assert names
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("row", criteria.TABLE, ids=lambda row: row.name)
def test_each_number_says_in_which_unit_it_is_and_why(row: criteria.Criterion) -> None:
    """A reason from a measurement, not a repetition of the name."""
    assert row.unit
    assert len(row.because.split()) >= 6, row.because
    assert row.value > 0.0


def test_each_number_is_used() -> None:
    """Another module uses it; unused numbers must be deleted."""
    body = ast.parse(CRITERIA.read_text(encoding="utf-8")).body
    given = {ast.unparse(item.targets[0]) for item in body if isinstance(item, ast.Assign) and _is_number(item)}
    assert len(given) == len(criteria.TABLE)
    used = set()
    for path in sorted((ROOT / "xy_sysid").rglob("*.py")):
        for item in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(item, ast.ImportFrom) and item.module == "xy_sysid.hypotheses.criteria":
                used |= {alias.name for alias in item.names}
    assert given <= used, f"not used by any module: {', '.join(sorted(given - used))}"


def _is_number(item: ast.Assign) -> bool:
    return isinstance(item.value, ast.Call) and ast.unparse(item.value.func) == "_number"


@pytest.mark.parametrize("path", STEERED, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_no_other_module_of_the_search_holds_a_number_of_its_own(path: Path) -> None:
    """A number that steers the search is in criteria, with its reason."""
    numbers = bare_numbers(path)
    assert not numbers, f"{path.name} holds {', '.join(numbers)}: put them into criteria"


def test_the_page_of_the_search_has_the_table() -> None:
    """python -m campaigns.documents.search --write"""
    assert document() in (ROOT / "docs" / "search.md").read_text(encoding="utf-8")
