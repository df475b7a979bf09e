"""The page of the study: complete, safe, and with the numbers of the fits."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.html_pages import parsed, plots

from xy_sim.machine import Machine
from xy_sysid.cli import run
from xy_sysid.excitation.lockstep import drive
from xy_sysid.fitting import identify, nllsfdi
from xy_sysid.fitting.of_recording import estimate, part
from xy_sysid.fitting.structure import structure_from
from xy_sysid.imports import save
from xy_sysid.paper.study import AxisStudy, study_axis
from xy_sysid.paper.study_page import study_page
from xy_sysid.report import parts
from xy_sysid.report.tables import coefficient_table, result_table
from xy_sysid.report.words import estimate_text, number
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings, IdentifierSettings

SETTINGS = IdentifierSettings()


@pytest.fixture(scope="module")
def recording() -> Recording:
    """40 s of the simulated table."""
    axes = {"x": AxisExcitation(seed=1), "y": AxisExcitation(seed=2)}
    settings = ExcitationSettings(rate=2000.0, lockstep=True, speed=0.0, axes=axes)
    return drive(Machine.from_file("paper.yaml"), settings, 40.0, lambda seconds: None)


@pytest.fixture(scope="module")
def study(recording: Recording) -> dict[str, AxisStudy]:
    return {axis: study_axis(recording, axis, SETTINGS) for axis in recording.axes}


@pytest.fixture(scope="module")
def page(study: dict[str, AxisStudy]) -> str:
    origin = {"Recording": {"source": "table.npz", "data_sha256": "abc123", "versions": {"numpy": "2"}, "notes": []}}
    return study_page("table.npz", study, ("V", "m"), SETTINGS.min_coherence, origin, ("The rate was odd.",))


def test_the_page_needs_nothing_but_itself(page: str) -> None:
    """No external source, link or import; below 8 MB, with plotly.js once."""
    for tag, attributes in parsed(page).tags:
        assert tag not in ("link", "iframe", "base"), tag
        for name in ("src", "href", "srcset", "action"):
            assert name not in attributes, (tag, attributes)
    assert "@import" not in page.split("</style>")[0] and "url(" not in page.split("</style>")[0]
    assert len(page.encode()) < 8_000_000
    assert page.count("plotly.js v") <= 2 and page.count("<script>") == 2


def test_every_figure_and_table_has_its_heading_caption_and_label(page: str) -> None:
    """Figures 2-7 and tables 1-2 in this order; each drawing has a description for screen readers."""
    found = parsed(page)
    text = "".join(found.text)
    places = [text.index(f"Figure {k}: ") for k in range(2, 8)] + [text.index(f"Table {k}: ") for k in (1, 2)]
    assert places == sorted(places)
    labelled = {attributes["id"] for tag, attributes in found.tags if attributes.get("role") == "img" and attributes.get("aria-label")}
    assert labelled == set(plots(page)) == {"plot-2", "plot-3", "plot-4", "plot-5", "plot-6-0", "plot-6-1", "plot-7-0", "plot-7-1"}
    tags = [tag for tag, _ in found.tags]
    assert tags.count("figure") == tags.count("figcaption") == 6
    assert tags.count("table") == tags.count("caption") == 5
    assert "prefers-color-scheme: dark" in page and 'name="viewport"' in page


def test_the_page_ends_with_where_it_comes_from(page: str) -> None:
    """Provenance is the last section, notes from reading are remarks."""
    text = "".join(parsed(page).text)
    assert text.index("Provenance") < text.index("abc123")
    assert text.index("Table 2: ") < text.index("The rate was odd.") < text.index("Provenance")


def test_the_numbers_are_those_of_the_fits(recording: Recording, study: dict[str, AxisStudy], page: str) -> None:
    """Table cells equal the results of the estimators for the same recording."""
    frf = estimate(recording, "x", SETTINGS).frf
    ml = identify(frf, structure_from(SETTINGS))
    nlls = nllsfdi.fit(frf, structure_from(SETTINGS))
    rows = {row[0]: row[1:] for row in result_table(study["x"]).rows}
    plain = {name: [cell.replace("\u00a0", " ") for cell in cells] for name, cells in rows.items()}
    assert plain["error cost = relative error (%)"][1:] == [number(nlls.error_cost, 4), number(ml.error_cost, 4)]
    assert plain["delay"] == ["absorbed", "absorbed", estimate_text(ml.interval("delay"))]
    assert plain["velocity gain"][2] == estimate_text(ml.interval("gain"))
    assert plain["resonance"][2] == estimate_text(ml.interval("resonance_1.frequency"))
    assert plain["antiresonance"][2] == estimate_text(ml.interval("antiresonance_1.frequency"))
    coefficients = {row[0].split()[0]: row[1:] for row in coefficient_table("x", study["x"].fits).rows}
    assert coefficients["b₂"][1] == number(nlls.tf.numerator[-3] * 1e3, 6)
    assert coefficients["a₀"][2:] == ("0", "fixed")
    for cells in (*rows.values(), *coefficients.values()):
        assert all(cell in page for cell in cells)


def test_the_delay_in_the_model_makes_the_difference_and_the_page_says_so(study: dict[str, AxisStudy], page: str) -> None:
    """Tens of per cent with the delay absorbed, about 1 % or less with delay and hold; delay and pair are those of the machine."""
    for axis, delay, antiresonance in (("x", 1.29e-3, 46.2), ("y", 1.38e-3, 46.4)):
        fits, pair = study[axis].fits, study[axis].pair
        assert fits["LLS"].error_cost > fits["NLLS"].error_cost > 10.0 > 1.5 > fits["ML"].error_cost
        assert fits["ML"].tf.delay == pytest.approx(delay, abs=5e-6)
        assert pair is not None and pair.antiresonance is not None
        assert pair.antiresonance.value == pytest.approx(antiresonance, abs=0.1)
    text = "".join(parsed(page).text)
    assert text.count("with the delay absorbed in the polynomials the relative error is") == 2
    assert "it is not a confidence interval" in text
    assert "Taken literally they are unstable" in text


def test_unstable_poles_and_poles_outside_the_band_are_named_only_where_they_are(study: dict[str, AxisStudy], page: str) -> None:
    """The remark exists if and only if the fit has such a pole."""
    text = "".join(parsed(page).text)
    for axis, one in study.items():
        for name, fit in one.fits.items():
            assert (f"Axis {axis}, {name}: unstable" in text) == (not fit.tf.is_stable)
    assert "Axis x, LLS: poles outside the measured band" in text
    assert "Axis x, ML: poles outside" not in text


def test_a_fallen_resonance_is_seen_against_a_second_recording(recording: Recording, study: dict[str, AxisStudy]) -> None:
    """A base that is 2 Hz lower shifts antiresonance and resonance down, with an interval that contains the truth and not zero."""
    axes = {"x": AxisExcitation(seed=5), "y": AxisExcitation(seed=6)}
    settings = ExcitationSettings(rate=2000.0, lockstep=True, speed=0.0, axes=axes)
    loose = part(drive(Machine.from_file("loose_bolts.yaml"), settings, 75.0, lambda seconds: None), slice(2000 * 36, 2000 * 75))
    one = study_axis(recording, "x", SETTINGS, 0, loose)
    assert one.change is not None
    shifts = {shift.name: shift for shift in one.change.shifts}
    assert shifts["antiresonance"].low < -2.0 < shifts["antiresonance"].high
    assert shifts["resonance"].certain and shifts["resonance"].value == pytest.approx(-2.1, abs=0.15)
    alone = study["x"].change
    assert alone is not None and not any(shift.certain for shift in alone.shifts)


def test_a_name_with_html_in_it_is_escaped(study: dict[str, AxisStudy]) -> None:
    """Text from files is escaped: names, notes, axes, provenance."""
    evil = '<img src=x onerror=alert(1)>"</script>'
    only = {evil: replace(study["x"], axis=evil)}
    made = study_page(evil, only, ("V", "m"), 0.3, {evil: {"source": evil, "notes": [evil]}}, (evil,))
    found = parsed(made)
    assert "img" not in [tag for tag, _ in found.tags]
    assert made.count("<script") == made.count("</script>") == 3
    assert f"Study of {evil}" in "".join(found.text)
    assert evil not in made
    for plot in plots(made).values():
        shown = [trace["name"] for trace in plot["data"]] + [json.dumps(plot["layout"])]
        assert not any("<img" in text for text in shown), "Plotly takes HTML in names for markup"


def test_a_recording_of_one_axis_in_other_units_has_its_page(recording: Recording) -> None:
    """rad per ampere are kept; no second axis is needed."""
    u, y = recording.axis("y")
    single = replace(recording, axes=("joint",), voltage=u[:, None], position=y[:, None], input_unit="A", output_unit="rad")
    one = study_axis(single, "joint", SETTINGS)
    made = study_page("one", {"joint": one}, ("A", "rad"), 0.3, {})
    text = "".join(parsed(made).text)
    assert "in rad/A and rad/s" in text and "rad/s/A" in text and "mm" not in text.replace("comm", "")
    assert set(plots(made)) == {"plot-2", "plot-3", "plot-4", "plot-5", "plot-6-0", "plot-7-0"}


def test_an_axis_without_excitation_is_named_and_does_not_stop_the_others(recording: Recording, study: dict[str, AxisStudy]) -> None:
    """The page gives the reason; the other axis is complete."""
    still = replace(recording, voltage=recording.voltage * np.array([1.0, 0.0]))
    other = study_axis(still, "y", SETTINGS)
    assert other.problem and not other.fits and other.frf is None
    made = study_page("half", {"x": study["x"], "y": other}, ("V", "m"), 0.3, {})
    text = "".join(parsed(made).text)
    assert "Axis y: input of axis y is constant" in text
    assert "plot-6-0" in plots(made) and "plot-6-1" not in plots(made)


def test_figures_hold_no_raw_signal_and_no_fixed_theme(page: str) -> None:
    """Long signals are decimated; the template follows the page's light or dark setting."""
    for name, plot in plots(page).items():
        assert "template" not in plot["layout"], name
        for trace in plot["data"]:
            for values in (trace.get("x"), trace.get("y")):
                size = len(values["bdata"]) * 3 / 4 / 8 if isinstance(values, dict) else len(values)
                assert size < 4000, (name, trace["name"])


def test_a_curve_is_not_drawn_over_lines_that_are_missing() -> None:
    """Gaps in the band interrupt it."""
    frequency = np.concatenate((np.arange(1.0, 5.0), np.arange(20.0, 30.0)))
    assert parts.unbroken(frequency) == [slice(0, 4), slice(4, 14)]
    assert parts.unbroken(np.arange(1.0, 40.0, 2.0)) == [slice(0, 20)]


def test_the_command_writes_the_page_and_speaks_one_json_document(
    recording: Recording, study: dict[str, AxisStudy], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 0; stdout is one document with the fits' numbers; the page exists."""
    source, out = tmp_path / "table.npz", tmp_path / "study.html"
    save(recording, source)
    assert run(["study", str(source), "-o", str(out), "--axis", "x", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    fits = document["axes"]["x"]["fits"]
    assert fits["ML"]["delay"] == pytest.approx(study["x"].fits["ML"].tf.delay, rel=1e-9)
    assert fits["NLLS"]["relative_error"] == pytest.approx(study["x"].fits["NLLS"].relative_error, rel=1e-9)
    assert out.stat().st_size == document["bytes"] and "Study of table.npz" in out.read_text(encoding="utf-8")
    assert run(["study", str(source), "-o", str(out), "--axis", "x", "--force"]) == 0
    assert "relative error" in capsys.readouterr().out


def test_wrong_use_of_the_command_is_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A missing file, a missing folder, a span without its recording, data that are too short."""
    short = tmp_path / "short.npz"
    seq = np.arange(12)
    random = np.random.default_rng(1).normal(size=(12, 1))
    save(Recording(100.0, ("x",), seq, seq / 100.0, random, random.cumsum(axis=0)), short)
    for arguments in (
        [str(tmp_path / "none.npz")],
        [str(short), "-o", str(tmp_path / "no" / "a.html")],
        [str(short), "-o", str(tmp_path)],
        [str(short), "--loose-span", "1:2", "-o", str(tmp_path / "a.html")],
        [str(short), "-o", str(tmp_path / "a.html")],
    ):
        assert run(["study", *arguments]) == 2, arguments
        told = capsys.readouterr()
        lines = [line for line in told.err.strip().splitlines() if not line.startswith("note: ")]
        assert told.out == "" and len(lines) == 1, arguments
    assert not (tmp_path / "a.html").exists()
