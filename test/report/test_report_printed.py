"""The head of a report, and the printed report: title, machine, author, date, page numbers, few and full pages."""

from __future__ import annotations

import dataclasses
import datetime
from pathlib import Path

import pypdfium2
import pytest
from helpers.browser_tools import browser, needs_browser
from helpers.cli_tools import cli, npz, refused
from helpers.html_pages import parsed

import xy_sysid as xy
from xy_sysid.imports import save
from xy_sysid.report.cover import Cover, cover_of, css_string
from xy_sysid.samples.recording import Recording

MOST = 12  # pages of a report on two axes
FOOT = 0.93  # fraction of a page's height, below which are the page number and the running title
TODAY = datetime.date(2026, 5, 4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of a named machine with another effect in each axis, and its report."""
    made = tmp_path_factory.mktemp("printed")
    recording = xy.simulate(20.0, effects=["x:coulomb_friction", "y:cogging"], machine="rigid.yaml")
    save(dataclasses.replace(recording, machine="router 3"), made / "2026-03-03_rec")
    said = cli("report", made / "2026-03-03_rec", "-o", made / "out.html", "--title", 'A <b>"new"</b> screw', "--author", "A. Bähr", "--json")
    assert said.code == 0, said
    head = {"title": 'A <b>"new"</b> screw', "machine": "router 3", "author": "A. Bähr", "date": "2026-03-03"}
    assert {name: said.json[name] for name in head} == head
    return made


def test_the_head_names_title_machine_author_and_date(folder: Path) -> None:
    """The machine comes from the meta data of the bag and the date from its name; the title is exactly the given one."""
    found = parsed((folder / "out.html").read_text(encoding="utf-8"))
    text = " ".join(" ".join(found.text).split())
    assert 'A <b>"new"</b> screw' in text
    assert "Machine router 3 Author A. Bähr Recorded 2026-03-03 Report written" in text


@needs_browser
@pytest.mark.parametrize("paper", ["A4", "Letter"])
def test_two_axes_are_printed_on_few_full_pages_with_numbers(folder: Path, paper: str) -> None:
    """At most 12 pages, each with title, machine and number at its foot, and only the last may end in its upper half."""
    with browser() as made:
        tab = made.new_context(offline=True).new_page()
        tab.goto((folder / "out.html").as_uri())
        tab.pdf(path=folder / f"{paper}.pdf", format=paper, prefer_css_page_size=False)
    printed = pypdfium2.PdfDocument(folder / f"{paper}.pdf")
    assert 4 < len(printed) <= MOST
    for number, page in enumerate(printed, 1):
        text = page.get_textpage().get_text_bounded()
        assert f"{number} / {len(printed)}" in text and "router 3" in text and "A. Bähr" in text and 'A <b>"new"</b> screw' in text
        ink = page.render(scale=0.5, grayscale=True).to_numpy().squeeze() < 128
        rows = ink.any(axis=1)[: int(FOOT * len(ink))].nonzero()[0]
        assert number == len(printed) or rows[-1] > len(ink) / 2, f"page {number} of {paper} is half empty"
        assert not ink[:, -int(0.02 * ink.shape[1]) :].any(), f"page {number} of {paper} is cut at its right"


def test_what_nobody_knows_is_left_out() -> None:
    """Without meta data, clock and dated name the cover has only a title and the day of the report."""
    recording = Recording.from_arrays(1000.0, [0.0] * 10, [0.0] * 10)
    cover = cover_of(recording, Cover(""), (Path("rec.csv"),), TODAY)
    assert cover == Cover("Report on rec.csv", written="2026-05-04")
    assert cover.lines == (("Report written", "2026-05-04"),) and cover.foot == "Report on rec.csv · 2026-05-04"


def test_the_clock_of_a_recording_tells_its_date() -> None:
    """Stamps since 1970 give a date, and a given date takes precedence; an invalid date is refused in one line."""
    recording = Recording.from_arrays(1000.0, [0.0] * 10, [0.0] * 10)
    recording = dataclasses.replace(recording, time=recording.time + 1_772_548_200.0, machine="lathe")
    assert cover_of(recording, Cover(""), (), TODAY).recorded == "2026-03-03 14:30 UTC"
    said = cover_of(recording, Cover("T", machine="mill", recorded="2025-01-02"), (), TODAY)
    assert (said.title, said.machine, said.recorded) == ("T", "mill", "2025-01-02")
    with pytest.raises(xy.BadInput, match="2026-03-03"):
        cover_of(recording, Cover("", recorded="yesterday"), (), TODAY)


def test_words_at_the_foot_steer_no_style_sheet() -> None:
    """Quotes, ends of elements and lines are written as CSS escapes."""
    assert css_string('a"b\\c</style>\n') == '"a\\22 b\\5c c\\3c /style\\3e \\a "'


def test_a_date_that_is_none_is_refused_before_the_recording_is_read(tmp_path: Path) -> None:
    """One line gives the format of a date; no page is written."""
    assert "2026-03-03" in refused("report", npz(tmp_path / "rec.npz"), "-o", tmp_path / "out.html", "--date", "soon")
    assert not (tmp_path / "out.html").exists()


def test_a_notebook_writes_the_same_report(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """``xy.write_report`` accepts a recording, a run or a path, and replaces no file without force."""
    monkeypatch.setattr("xy_sysid.report.axis_report.told", nothing_told)
    recording = xy.load(npz(tmp_path / "rec.npz", rows=4000))
    xy.write_report(recording, tmp_path / "out.html", machine="mill 7", recorded=datetime.date(2026, 3, 3))
    text = " ".join(parsed((tmp_path / "out.html").read_text(encoding="utf-8")).text)
    assert "mill 7" in text and "2026-03-03" in text and "Report on rec.npz" in text and "xy_sysid.write_report" in text
    with pytest.raises(xy.BadInput, match="force=True"):
        xy.write_report(recording.run("x"), tmp_path / "out.html")


def nothing_told(*_: object) -> None:
    raise xy.BadInput("samples", "few", "enough", "This test needs no diagnosis.")


@pytest.mark.parametrize("name", ["bag", "bag.db3"])
def test_a_saved_bag_keeps_the_name_of_its_machine(tmp_path: Path, name: str) -> None:
    """In its meta data, which a single file lacks; a recording without the name has none after loading."""
    recording = dataclasses.replace(xy.Recording.from_arrays(100.0, [0.0, 1.0] * 50, [0.0, 0.1] * 50), machine="router 3")
    save(recording, tmp_path / name)
    assert xy.load(tmp_path / name).machine == ("router 3" if name == "bag" else "")
