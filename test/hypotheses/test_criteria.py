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

DECIDING = [path for package in ("hypotheses", "diagnosis", "greybox", "effects", "story") for path in (ROOT / "xy_sysid" / package).rglob("*.py")]
BOUNDS = ("min", "max", "minimum", "maximum", "clip", "quantile", "percentile")
PLAIN = {0, 0.5, 1, 2, 3, 4, 12}  # counts, halves and quarters, signs and squares; the variance of rounding is 1/12
GUARD = 1e-6


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


def bare_comparisons(path: Path) -> list[str]:
    """Numbers without a name in comparisons, bounds and quantiles of a module; small ones only avoid a division by zero."""
    found = []
    for item in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        called = ast.unparse(item.func).rsplit(".", 1)[-1] if isinstance(item, ast.Call) else ""
        bounds = called in BOUNDS and "effects" not in path.parts  # start values of an effect have bounds
        if isinstance(item, ast.Compare) or (isinstance(item, ast.Call) and bounds):
            values = [node.value for node in ast.walk(item) if isinstance(node, ast.Constant)]
            numbers = [value for value in values if isinstance(value, int | float) and value not in PLAIN and value > GUARD]
            found += [f"line {item.lineno}: {number:g}" for number in numbers]
    return found


def test_a_number_that_decides_has_a_name() -> None:
    """In comparisons, bounds and quantiles of search, grey box and story, and in comparisons of effects."""
    wrong = {str(path.relative_to(ROOT)): bare for path in DECIDING if (bare := bare_comparisons(path))}
    assert not wrong


def test_a_number_without_a_name_is_noticed(tmp_path: Path) -> None:
    """A threshold, a bound and a quantile; but no count, no half, and no guard of a division."""
    path = tmp_path / "one.py"
    path.write_text("a = x > 0.3\nb = min(x, 7.0)\nc = np.quantile(x, 0.9)\nd = x > 0.0 and y / max(z, 1e-300) > x[2] / 2\n", encoding="utf-8")
    assert bare_comparisons(path) == ["line 1: 0.3", "line 2: 7", "line 3: 0.9"]


def test_the_page_of_the_search_has_the_table() -> None:
    """python -m campaigns.documents.search --write"""
    assert document() in (ROOT / "docs" / "search.md").read_text(encoding="utf-8")
