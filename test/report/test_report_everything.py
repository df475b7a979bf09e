"""The report: complete, with reasons for missing results, safe, and one file."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser_tools import browser, needs_browser
from helpers.cli_tools import cli, npz, refused, rigid
from helpers.html_pages import parsed, plots

from xy_sysid.units import Units


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with Coulomb friction on x and nothing on y, and its report."""
    made = tmp_path_factory.mktemp("report")
    said = cli("simulate", made / "rec.npz", "--machine", "rigid.yaml", "--effect", "x:coulomb_friction", "--duration", "20")
    assert said.code == 0, said
    return made


@pytest.fixture(scope="module")
def answer(folder: Path) -> dict[str, Any]:
    """The output of the command, which writes the page."""
    said = cli("report", folder / "rec.npz", "-o", folder / "out.html", "--json")
    assert said.code == 0, said
    document: dict[str, Any] = said.json
    return document


@pytest.fixture(scope="module")
def page(folder: Path, answer: dict[str, Any]) -> str:
    return (folder / "out.html").read_text(encoding="utf-8")


def words_of(page: str) -> str:
    return " ".join(" ".join(parsed(page).text).split())


def test_the_report_is_one_file_that_needs_no_network(page: str, answer: dict[str, Any]) -> None:
    """No external source or link, and below 8 MB."""
    for tag, attributes in parsed(page).tags:
        assert tag not in ("link", "iframe", "base", "img"), tag
        assert not {"src", "srcset", "action"} & set(attributes)
        assert (attributes.get("href") or "#").startswith("#"), attributes
    assert answer["bytes"] == len(page.encode()) < 8_000_000


def test_a_manager_reads_the_summary_first(page: str) -> None:
    """Each axis has a verdict in words, the error relative to motion and noise, and the falling error ladder."""
    text = words_of(page).partition("Provenance")[2]  # behind the links at the top
    assert text.index("Summary") < text.index("A rigid axis with delay and coulomb friction") < text.index("Remarks")
    assert "is sufficient: the data show no missing effect" in text
    assert "on the held-out part" in text and "% of the speed" in text
    assert "The linear fit alone, without coulomb friction: relative error" in text and "checks of the linear fit passed" in text
    assert "coulomb_friction" not in text.partition("Provenance")[0]


def test_every_part_of_the_report_is_there(page: str) -> None:
    """Summary, experiment, response, fits, one part per axis, provenance, each linked from the top; words for every figure."""
    found = parsed(page)
    ids = {attributes["id"] for _, attributes in found.tags if "id" in attributes}
    links = {str(attributes["href"])[1:] for tag, attributes in found.tags if tag == "a"}
    assert {"summary", "experiment", "response", "fits", "axis-0", "axis-1", "provenance"} <= links <= ids
    labelled = {attributes["id"] for _, attributes in found.tags if attributes.get("role") == "img" and attributes.get("aria-label")}
    assert labelled == set(plots(page))
    text = words_of(page)
    for part in (
        "LLS NLLS ML",
        "Checks of the linear fit (ML)",
        "Where the rigid model fails",
        "What is missing",
        "parameters of the last model",
        "the ladder",
    ):
        assert part in text


def test_the_numbers_are_those_of_the_story(page: str, answer: dict[str, Any]) -> None:
    """Parameters of the table have intervals; the friction is the simulated one."""
    friction = answer["axes"]["x"]["story"]["model"]["parameters"]["coulomb_friction.coulomb"]
    assert friction["value"] == pytest.approx(0.2, rel=0.01)
    low, high = friction["ci95"]
    assert low < friction["value"] < high
    assert "coulomb friction: coulomb" in words_of(page)
    assert answer["axes"]["y"]["story"]["verdict"] == "nothing_missing" and answer["axes"]["y"]["status"] == "explained"
    assert answer["axes"]["x"]["status"] == "explained" and len(answer["axes"]["x"]["story"]["ladder"]) == 2


def test_provenance_tells_data_command_and_versions(page: str, answer: dict[str, Any]) -> None:
    """The hash of the samples, the command line and the versions are on the page."""
    text = words_of(page)
    for value in (answer["recording"]["data_sha256"]["x"], answer["recording"]["versions"]["numpy"], "xy-sysid"):
        assert value in text


def test_a_rigid_table_gets_rigid_orders_and_the_page_says_why(answer: dict[str, Any], page: str) -> None:
    """Without given orders, the report shows a stable and physical axis, and the criterion of the choice."""
    checks = answer["axes"]["y"]["checks"]
    assert checks["stable"]["ok"] and checks["feasible"]["ok"]
    shown = len(answer["axes"]["y"]["linear"]["fits"]["ML"]["denominator"])
    assert shown == 3 and "Orders 0/2, chosen from the data" in words_of(page)


def test_data_of_which_nothing_can_be_said_give_a_report_that_says_so(tmp_path: Path) -> None:
    """No motion: exit 0, a page with the reason in the summary and no story."""
    path = npz(tmp_path / "still.npz", u=lambda content: 0 * content["u"], y=lambda content: 0 * content["y"])
    said = cli("report", path, "-o", tmp_path / "still.html")
    assert said.code == 0 and "nothing can be said" in said.out
    text = words_of((tmp_path / "still.html").read_text(encoding="utf-8"))
    assert "the input does not move" in text.split("Experiment")[1] and "not excited" in text


def test_a_recording_of_other_units_keeps_them(tmp_path: Path) -> None:
    """Ampere and radian: no millimetre and no volt in the answer."""
    path = npz(tmp_path / "motor.npz", rows=10_000, u_unit="A", y_unit="rad")
    said = cli("report", path, "-o", tmp_path / "motor.html", "--json")
    story = said.json["axes"]["x"]["story"]
    assert story["model"]["parameters"]["gain"]["unit"] == "rad/s/A"
    text = words_of((tmp_path / "motor.html").read_text(encoding="utf-8"))
    assert "rad/s" in text and not re.search(r"\bmm\b", text)


def test_the_models_units_become_those_of_the_axis() -> None:
    """V and m are replaced everywhere, also with powers; brackets around a denominator of more than one unit."""
    motor, joint = Units("A", "rad"), Units("N m", "rad")
    assert [motor.of(unit) for unit in ("m/s/V", "V/m", "V/m3", "1/m2", "Hz", "rad/s", "")] == [
        "rad/s/A", "A/rad", "A/rad3", "1/rad2", "Hz", "rad/s", "",
    ]  # fmt: skip
    assert joint.of("m/s/V") == "rad/s/(N m)" and joint.of("V/(m/s)") == "N m/(rad/s)" and Units("V", "counts").speed == "counts/s"
    assert Units().of("m/(V s)") == "m/(V s)"


def test_names_from_a_file_cannot_become_markup(tmp_path: Path) -> None:
    """An axis named like a tag is shown, not executed."""
    content = rigid(8_000)
    rows = np.column_stack((content["t"], content["u"], content["y"]))
    path = tmp_path / "bad.csv"
    path.write_text("time,<b>_voltage,<b>_position\n" + "\n".join(",".join(f"{value:.12g}" for value in row) for row in rows))
    said = cli("report", path, "-o", tmp_path / "bad.html")
    assert said.code == 0, said
    assert "<b>" not in re.sub(r"<script.*?</script>", "", (tmp_path / "bad.html").read_text(encoding="utf-8"), flags=re.S)


def test_wrong_use_is_one_line(tmp_path: Path, folder: Path) -> None:
    """No recording, no folder, no such axis: exit 2, one line, no file."""
    assert "cannot be read" in refused("report", tmp_path / "none.npz")
    assert "folder" in refused("report", folder / "rec.npz", "-o", tmp_path / "no" / "out.html")
    assert "axis is z" in refused("report", folder / "rec.npz", "-o", tmp_path / "out.html", "--axis", "z")
    assert not list(tmp_path.iterdir())


def test_the_answer_is_plain_json(answer: dict[str, Any]) -> None:
    """One document, without the pictures' rows."""
    assert len(json.dumps(answer)) < 100_000
    assert set(answer["axes"]) == {"x", "y"}


@needs_browser
@pytest.mark.parametrize(("width", "mode"), [(1400, "light"), (400, "dark")])
def test_the_report_opens_in_a_browser_without_a_network(folder: Path, page: str, width: int, mode: str) -> None:
    """No error, no request except the file; every figure is drawn when it becomes visible; the page is as wide as the window."""
    with browser() as made:
        context = made.new_context(viewport={"width": width, "height": 900}, color_scheme=mode, offline=True)
        tab = context.new_page()
        wrong: list[str] = []
        asked: list[str] = []
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto((folder / "out.html").as_uri())
        names = list(plots(page))
        for name in names:
            tab.locator(f"#{name}").scroll_into_view_if_needed()
            tab.locator(f"#{name} .main-svg").first.wait_for(timeout=10_000)
        assert not wrong and asked == [(folder / "out.html").as_uri()]
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        ink = tab.evaluate("getComputedStyle(document.querySelector('#ladder-0 .xtick text')).fill")
        assert ink == ("rgb(36, 41, 47)" if mode == "light" else "rgb(215, 220, 225)")
        tab.emulate_media(color_scheme="dark" if mode == "light" else "light")
        tab.wait_for_function("ink => getComputedStyle(document.querySelector('#ladder-0 .xtick text')).fill != ink", arg=ink, timeout=20_000)


PRINTED = 688  # px of both A4 and letter between margins of 14 mm


@needs_browser
def test_every_picture_is_on_paper_and_none_is_cut(folder: Path, page: str) -> None:
    """Before printing all figures are drawn, as wide as A4 and letter allow; headings stay with their text; the numbers can be saved."""
    with browser() as made:
        tab = made.new_context(viewport={"width": 1000, "height": 700}, offline=True).new_page()
        tab.goto((folder / "out.html").as_uri())
        tab.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        tab.wait_for_timeout(500)
        assert tab.locator(".plot .main-svg").count() >= len(plots(page))
        assert tab.evaluate("[...document.querySelectorAll('.plot')].every((box) => box.querySelector('.main-svg'))")
        widest = "Math.max(...[...document.querySelectorAll('.main-svg')].map((box) => box.getBoundingClientRect().right))"
        assert tab.evaluate(widest) <= PRINTED
        tab.emulate_media(media="print")
        assert tab.evaluate("Math.max(...[...document.querySelectorAll('table')].map((box) => box.getBoundingClientRect().right))") <= PRINTED
        assert tab.evaluate("getComputedStyle(document.querySelector('h3')).breakAfter") == "avoid"
        tab.emulate_media(media="screen")
        tab.evaluate("window.dispatchEvent(new Event('afterprint'))")
        tab.wait_for_timeout(200)
        assert tab.evaluate(widest) > PRINTED
        with tab.expect_download() as taken:
            tab.locator("[data-keep=csv][data-of=ladder-0]").click()
        assert "held-out error: rms error (mm/s)" in Path(taken.value.path()).read_text(encoding="utf-8").splitlines()[0]


def test_a_long_recording_is_judged_on_its_first_part(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Memory is limited, and the page says so."""
    monkeypatch.setattr("xy_sysid.report.axis_report.LONGEST", 8.0)
    path = npz(tmp_path / "long.npz", rows=12_000)
    said = cli("report", path, "-o", tmp_path / "long.html", "--json")
    assert said.json["axes"]["x"]["story"]["seconds"] == pytest.approx(8.0)
    assert "uses the first 8 s of the longest stretch, of 12 s" in words_of((tmp_path / "long.html").read_text(encoding="utf-8"))
