"""Said once, checked everywhere: generated pages are up to date, commands named in texts exist."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from helpers import ROOT

from campaigns.documents.architecture import PICTURE, picture, reduced
from campaigns.documents.man import document as man_page
from campaigns.documents.settings import document
from xy_sysid.cli.app import app
from xy_sysid.live.diagnosis_messages import LADDER_COLUMNS
from xy_sysid.live.messages import COMPARISON_COLUMNS, FRF_COLUMNS
from xy_sysid.response.window_check import REASONS as WINDOW_REASONS
from xy_sysid.samples.pairing import REASONS as STREAM_REASONS

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "config" / "README.md"]


def test_the_settings_page_is_made_from_the_settings() -> None:
    """python -m campaigns.documents.settings > docs/settings.md"""
    assert (ROOT / "docs" / "settings.md").read_text(encoding="utf-8") == document()


def test_the_man_page_is_made_from_the_commands() -> None:
    """python -m campaigns.documents.man --write; it contains every command with all options, and troff gives no warning."""
    page = (ROOT / "docs" / "xy-sysid.1").read_text(encoding="utf-8")
    assert page == man_page()
    groff = shutil.which("groff")
    if groff is not None:
        told = subprocess.run([groff, "-man", "-Tutf8", "-ww"], input=page, capture_output=True, text=True, check=True)
        assert told.stderr == "" and "User Commands" in told.stdout


def test_the_picture_of_the_packages_is_made_from_the_imports() -> None:
    """python -m campaigns.documents.architecture --write"""
    assert picture(ROOT / "xy_sysid") == (ROOT / PICTURE).read_text(encoding="utf-8")


def test_the_picture_leaves_out_what_a_longer_way_says_already() -> None:
    """a -> b -> c: a direct import of a by c is not drawn."""
    assert reduced({("b", "a"): 1, ("c", "b"): 1, ("c", "a"): 1}) == [("a", "b"), ("b", "c")]


def test_the_architecture_names_files_that_are_there() -> None:
    """Where do I change what: every file and module of the page exists."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = page.split("## Where do I change what")[1]
    for name in re.findall(r"`((?:[a-z]+/)[a-z_*]*(?:\.py)?)`", table):
        base = ROOT if name.startswith("config/") else ROOT / "xy_sysid"
        assert list(base.glob(name)), name
    for name in re.findall(r"`([a-z_]+\.[a-z_0-9]+)(?:\.\w+)*`", page):
        package, module = name.split(".")
        if (ROOT / "xy_sysid" / package).is_dir():
            home = importlib.import_module(f"xy_sysid.{package}")
            assert hasattr(home, module) or (ROOT / "xy_sysid" / package / f"{module}.py").is_file(), name


def test_the_page_of_commands_lists_every_command() -> None:
    """The table lists exactly the existing commands."""
    names = {command.name for command in app.registered_commands}
    text = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    first = re.findall(r"^\| (`.*?`) \|", text, re.MULTILINE)
    assert set(re.findall(r"`xy-sysid (\w+)", " ".join(first))) == names


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as by GitHub and MkDocs."""
    plain = (re.sub(r"[^\w\s-]", "", heading.lower()) for heading in re.findall(r"^#+ +(.*)$", page.read_text(encoding="utf-8"), re.MULTILINE))
    return {name for heading in plain for name in (re.sub(r"\s", "-", heading), re.sub(r"[-\s]+", "-", heading))}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    """Relative links point to existing files and headings."""
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            name, _, heading = target.partition("#")
            to = page.parent / name if name else page
            assert to.exists(), f"{page.name}: {target}"
            assert not heading or heading in anchors(to), f"{page.name}: {target}"


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
