"""The bibliography contains every work that the code cites."""

from __future__ import annotations

import re

import pytest
from helpers import ROOT

from xy_sysid.effects import EFFECTS

TEXT = (ROOT / "docs" / "bibliography.md").read_text(encoding="utf-8")
SURNAME = r"(?:O')?[A-Z][a-z]+(?:-[A-Z][a-z]+)?"
CITED = re.compile(rf"\(({SURNAME}(?:(?:, | & ){SURNAME})*),? ((?:19|20)\d\d)\b")


def test_every_work_that_a_docstring_cites_by_author_and_year_is_listed() -> None:
    """(Welch 1967), (Carter, Knapp & Nuttall 1973): all names are in one entry, with the year."""
    entries = re.split(r"\n(?=- )", TEXT)
    found = {match.groups() for path in (ROOT / "xy_sysid").rglob("*.py") for match in CITED.finditer(path.read_text(encoding="utf-8"))}
    missing = [
        (names, year)
        for names, year in found
        if not any(year in entry and all(name in entry for name in re.findall(SURNAME, names)) for entry in entries)
    ]
    assert len(found) > 15 and missing == []


@pytest.mark.parametrize("name", list(EFFECTS))
def test_the_source_of_every_effect_is_listed(name: str) -> None:
    """By its first author, or the number of its standard."""
    for source in EFFECTS[name].source.split("; "):
        words = re.match(rf"(?:[A-Z]\. )?({SURNAME}|ISO [\d-]+)", source)
        if words is not None and words.group(1) != "Newton":
            assert words.group(1) in TEXT, source
