"""Other analyses of a file on the page: coupling, step tests, servos, a measured response, columns of two files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.table_making import csv_of
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.live.plain_messages import OK, ArrayMessage, StatusMessage
from xy_sysid.page.responses import fitted_responses
from xy_sysid.page.shelf import Shelf
from xy_sysid.page.topics_state import TopicsState

RATE = 500.0


def two_axes(folder: Path) -> Path:
    """A CSV of two axes; each drive moves the other axis by 5 %."""
    u = np.random.default_rng(2).normal(size=(6000, 2))
    moved = signal.lfilter([0.1], [1.0, -0.9], u + 0.05 * u[:, ::-1], axis=0)
    position = np.cumsum(moved, axis=0) / RATE
    columns = {"time": np.arange(len(u)) / RATE}
    for k, axis in enumerate("xy"):
        columns |= {f"{axis}_voltage": u[:, k], f"{axis}_position": position[:, k]}
    return csv_of(folder, columns)


def response(folder: Path) -> Path:
    """A PI controller as an analyser exports it."""
    frequency = np.geomspace(1.0, 100.0, 60)
    value = 2.0 + 30.0 / (2j * np.pi * frequency)
    value = value * (1.0 + 1e-3 * np.random.default_rng(1).normal(size=60))
    rows = np.column_stack((frequency, 20 * np.log10(np.abs(value)), np.rad2deg(np.angle(value))))
    np.savetxt(folder / "frf.csv", rows, "%.9g", ",", header="frequency (Hz),magnitude (dB),phase (deg)", comments="")
    return folder / "frf.csv"


@needs_browser
def test_the_page_answers_what_the_commands_answer(tmp_path: Path) -> None:
    """Coupling with its figure, a step test in words, a response measured elsewhere with its fit, and input and output in two files."""
    two = two_axes(tmp_path)
    u = np.random.default_rng(3).normal(size=3000)
    np.savetxt(tmp_path / "u.csv", u, "%.9g")
    np.savetxt(tmp_path / "y.csv", np.cumsum(signal.lfilter([0.1], [1.0, -0.9], u)) / RATE, "%.9g")
    server = Server(tmp_path, two, response(tmp_path))
    try:
        with browser() as made:
            tab = Tab(made, server.address)
            page = tab.page
            asked, said = page.locator("[data-act=coupling]").first, page.locator("[data-part=coupling]").first
            tab.until(lambda: asked.count() and asked.is_visible(), 60.0, "no card of two axes")
            tab.click_until(asked, lambda: "do not suffice" in (said.text_content() or ""), 60.0, "no verdict")
            tab.until(lambda: tab.curves("x and y are coupled", "at most")[0], 20.0, "no picture of the coupling")
            answer = page.locator("[data-part=answer]").first
            tab.click_until(page.locator("[data-ask=steps]").first, lambda: "time_constant" in (answer.text_content() or ""), 60.0, "no answer")
            tab.until(lambda: "numerator" in (page.locator("[data-part=responses]").last.text_content() or ""), 60.0, "no fit of the response")
            chosen = page.get_by_role("combobox", name="recording")
            tab.click_until(page.get_by_role("button", name="Open a recording").first, chosen.is_visible)
            chosen.click()
            page.get_by_role("option", name="u.csv", exact=True).click()
            page.get_by_role("button", name="Columns ...").click()
            page.locator("[data-pick=other]").last.click()
            page.get_by_role("option", name="y.csv", exact=True).click()
            page.locator("[data-pick=rate]").last.fill("500")
            page.wait_for_timeout(500)
            for role, column in (("input", "1"), ("output", "y.csv:1")):
                page.locator(f"[data-pick={role}]").last.click()
                tab.until(lambda: page.get_by_role("listbox").count() == 1, 20.0, "the list before is still open")
                page.get_by_role("option", name=column, exact=True).click()
            page.locator("[data-pick=open]").last.click()
            tab.until(lambda: "u.csv" in (page.locator("[role=banner]").text_content() or ""), 20.0, "two files were not opened")
            tab.until(lambda: page.locator("[data-part=headline]").count() >= 2 and "rec3" in page.content(), 60.0)
            assert tab.errors == []
    finally:
        server.end()


def test_a_measured_response_is_drawn_with_its_fit(tmp_path: Path) -> None:
    """Figure and words; a file of samples is not a response."""
    (told,) = (fitted_responses(response(tmp_path), {}) or {}).values()
    assert "PI" not in told["words"] and "gain" in told["words"] and told["figure"]["data"]
    assert fitted_responses(two_axes(tmp_path), {}) is None


def test_texts_are_listed_when_asked_for_and_columns_come_from_the_folder_only(tmp_path: Path) -> None:
    """JSON and text files are rarely recordings; a column of a file outside the folder is refused."""
    folder = tmp_path / "shelf"
    folder.mkdir()
    for name in ("a.csv", "b.csv", "log.json"):
        (folder / name).write_text("1\n")
    (tmp_path / "secret.csv").write_text("1\n")
    shelf = Shelf(folder)
    assert shelf.names() == ["a.csv", "b.csv"] and "log.json" in shelf.names(texts=True)
    assert shelf.find("log.json") == folder / "log.json"
    shelf.beside(folder / "a.csv", {"input": "1", "output": "b.csv:1"})
    for outside in ("../secret.csv:1", f"{tmp_path}/secret.csv:1"):
        with pytest.raises(BadInput, match=r"file of a column is 'secret.csv'"):
            shelf.beside(folder / "a.csv", {"input": "1", "output": outside})


def test_the_verdict_of_the_identifier_is_heard_and_its_topic_is_no_axis() -> None:
    """Sentence from the status, bands from the topic; the axes stay x and y."""
    heard = TopicsState()
    for axis in "xy":
        heard.array(ArrayMessage(f"frf/{axis}", ("line", "frequency"), (1, 1), np.ones(1)))
    assert heard.coupling() == ("", None)
    heard.array(ArrayMessage("coupling/x_and_y", ("band", "low,high,at_least,at_most"), (1, 4), np.ones(4)))
    heard.status(StatusMessage("coupling of x and y", OK, "two single-axis models suffice", ()), 0.0)
    said, bands = heard.coupling()
    assert said == "two single-axis models suffice" and bands is not None
    assert heard.axes() == ("x", "y")
