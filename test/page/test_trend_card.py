"""The trend of a table on the page: the sentences of the command, and the parameters over time."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.cli_tools import cli
from helpers.fleet_tables import gain_falls, recorded
from nicegui import run

from xy_sysid.errors import BadInput
from xy_sysid.fleets.table import merged
from xy_sysid.page.beside import beside, returned
from xy_sysid.page.shelf import Shelf
from xy_sysid.page.trend_card import find, found, tables


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("shelf")
    gain_falls(made / "t")
    (made / "empty").mkdir()
    return made


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[Server]:
    made = Server(folder, "--no-live")
    yield made
    made.end()
    assert "Traceback" not in made.said(), made.said()


@needs_browser
@pytest.mark.parametrize("width", [1400, 400])
def test_a_table_is_opened_and_its_change_is_told_as_by_the_command(server: Server, folder: Path, width: int) -> None:
    """One button: the sentences of ``xy-sysid trend``, the changed parameter of the changed axis, and that of all axes; the page fits the width."""
    with browser() as chromium:
        tab = Tab(chromium, server.address, width)
        tab.until(lambda: tab.page.locator("[data-act=trend]:visible").count() == 1)
        events = tab.page.locator("#trend .events li")
        tab.press("trend")
        tab.until(lambda: events.count() == 1, 60.0)
        said = str(events.first.text_content())
        assert f"- {said}" in cli("trend", folder / "t").out
        assert "Recordings that could not be read: 1 (mill-00: 1)." in str(tab.page.locator("[data-part=summary]:visible").text_content())
        tab.until(lambda: drawn(tab, "gain of mill-01 x over time") and drawn(tab, "gain of all axes over time"), 30.0)
        assert tab.wide() <= width
        cut = "[...document.querySelectorAll('#trend .q-field__label')].some((label) => label.scrollWidth > label.clientWidth)"
        assert not tab.page.evaluate(cut), "a label of a menu is cut, also for a short name"
        assert tab.page.locator("[data-part='trend of all axes']").text_content() == "gain of all axes"
        assert tab.errors == []


@pytest.mark.parametrize(("table", "words"), [("short", "allowed: an axis with 4 of them"), ("damaged", "a.parquet: cannot be read as Parquet")])
def test_a_table_without_a_trend_is_told_in_the_words_of_the_command(table: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error of the other process arrives on the page, not a request to report it."""
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "a.parquet").write_bytes(b"PAR1")
    (tmp_path / "short").mkdir()
    merged(tmp_path / "short", [recorded("mill-00", 0, 0.1)])
    said: list[str] = []
    session: Any = SimpleNamespace(say=said.append)
    monkeypatch.setattr(run, "process_pool_start_method", "spawn")
    run.setup()
    try:
        assert asyncio.run(beside(session, lambda: run.cpu_bound(returned, found, tmp_path / table))) is None
    finally:
        run.reset()
    assert len(said) == 1 and words in said[0]


def drawn(tab: Tab, label: str) -> bool:
    """True if the figure with that description has data."""
    plot: Any = tab.page.locator(f"#trend .js-plotly-plot[aria-label^='{label}'] .scatterlayer .trace")
    return bool(plot.count())


def test_only_folders_of_the_shelf_that_are_tables_can_be_opened(folder: Path) -> None:
    """The browser sends a name of the list, never a path."""
    shelf = Shelf(folder)
    assert tables(shelf) == ["t"]
    assert find(shelf, "t") == folder.resolve() / "t"
    with pytest.raises(BadInput, match="one of the list"):
        find(shelf, "../elsewhere")


def test_a_folder_that_cannot_be_read_has_no_table(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unreadable folder, such as lost+found: the page opens, with all other tables."""
    closed, scan = folder / "lost+found", os.scandir
    closed.mkdir()

    def scanned(path: Any) -> Any:
        if Path(path).name == closed.name:
            raise PermissionError(13, "Permission denied", str(path))
        return scan(path)

    monkeypatch.setattr(os, "scandir", scanned)
    monkeypatch.setattr(os, "listdir", lambda path: [entry.name for entry in scanned(path)])
    assert tables(Shelf(folder)) == ["t"]
    closed.rmdir()


def test_no_recording_is_asked_for_its_status(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables are found by names alone: opening thousands of recordings on a network share would take too long."""
    status = Path.stat

    def asked(path: Path, **how: Any) -> Any:
        assert path.suffix != ".parquet", path
        return status(path, **how)

    monkeypatch.setattr(Path, "stat", asked)
    assert tables(Shelf(folder)) == ["t"]
