"""Said once, checked everywhere: pages made from tables do not drift, commands named in words exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from xy_sysid.cli.app import app
from xy_sysid.live_story import LADDER_COLUMNS
from xy_sysid.messages import COMPARISON_COLUMNS, FRF_COLUMNS
from xy_sysid.pairing import REASONS as STREAM_REASONS
from xy_sysid.settings_doc import document
from xy_sysid.window_check import REASONS as WINDOW_REASONS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "config" / "README.md"]


def test_the_settings_page_is_made_from_the_settings() -> None:
    """python -m xy_sysid.settings_doc > docs/settings.md"""
    assert (ROOT / "docs" / "settings.md").read_text(encoding="utf-8") == document()


def test_the_readme_lists_every_command() -> None:
    """No command is missing from the table, and none is made up."""
    names = {command.name for command in app.registered_commands}
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `xy-sysid (\w+)", text, re.MULTILINE)) == names


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    """Relative links point at files that are there."""
    for target in re.findall(r"\]\(([^)#]+?)\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_topics_page_names_every_column_and_reason() -> None:
    """Columns and reasons of dropped windows are those of the code."""
    text = (ROOT / "docs" / "topics.md").read_text(encoding="utf-8")
    assert ",".join(FRF_COLUMNS) in text
    assert ",".join(COMPARISON_COLUMNS) in text
    assert ",".join(LADDER_COLUMNS) in text
    for reason in ("lost", "not_finite", "time_jump", "restart", "overrun"):
        assert reason in STREAM_REASONS
        assert f"`{reason}`" in text
    for reason in WINDOW_REASONS:
        assert f"`{reason}`" in text
