"""Figures as vectors without a browser: every figure of a story as SVG and PDF, with its text and curves."""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from helpers.cli_tools import cli, refused
from helpers.stories import told

from xy_sysid.errors import MissingExtra
from xy_sysid.report.gallery import gallery, written
from xy_sysid.report.vector import vectors
from xy_sysid.story.document import document


def paths(svg: bytes) -> int:
    return sum(1 for item in ET.fromstring(svg).iter() if item.tag.endswith(("path", "use")))


def test_every_picture_of_a_story_becomes_vectors() -> None:
    """The full gallery: not empty, no bitmap, and the same bytes each time."""
    figures = gallery(document(told()))
    assert {"error_ladder", "frequency_response", "candidate_effects", "rigid_model_fails_by_speed", "last_model_fails_by_frequency"} <= set(figures)
    for name, figure in figures.items():
        svg = vectors(figure, ["svg"])["svg"]
        assert b"<image" not in svg and paths(svg) > 20, name
    assert vectors(figures["error_ladder"], ["svg"]) == vectors(figures["error_ladder"], ["svg"])
    assert vectors(figures["error_ladder"], ["pdf"])["pdf"][:5] == b"%PDF-"


@pytest.mark.parametrize(("columns", "width"), [(1, 88.0), (2, 181.0)])
def test_a_figure_is_as_wide_as_the_columns_of_a_journal_and_clips_nothing(columns: int, width: float) -> None:
    """88 and 181 mm, and every word, from the name of an effect to the runner-up's error, is on the page."""
    for name, figure in gallery(document(told())).items():
        size, words = words_on(figure, columns)
        assert size[0] == pytest.approx(width / 25.4), name
        assert words
        for text, box in words.items():
            assert box.x0 >= -0.5 and box.y0 >= -0.5 and box.x1 <= size[0] * 100 + 0.5 and box.y1 <= size[1] * 100 + 0.5, (name, text)


def words_on(figure: go.Figure, columns: int) -> tuple[tuple[float, float], dict[str, Any]]:
    """(width, height) in inches and the bounding box of all text in dots of 1/100 inch."""
    from xy_sysid.report.vector import drawn

    paper = drawn(figure, columns)
    assert paper.dpi == 100
    paper.draw_without_rendering()
    texts = [*paper.texts, *(text for legend in paper.legends for text in legend.get_texts()), *(text for axes in paper.axes for text in axes.texts)]
    boxes: dict[str, Any] = {text.get_text(): text.get_window_extent() for text in texts if text.get_text()}
    boxes |= {f"axes {number}, with all names and numbers": axes.get_tightbbox() for number, axes in enumerate(paper.axes)}
    return (float(paper.get_figwidth()), float(paper.get_figheight())), boxes


def test_upright_bars_stand_where_their_numbers_say() -> None:
    """As many bars as numbers, all of one width, from zero to the number."""
    from xy_sysid.report.vector import drawn

    figure = go.Figure([go.Bar(x=[0.0, 2.0], y=[1.0, -1.0], name="few"), go.Bar(x=[1.0], y=[0.5], name="many")])
    (axes,) = drawn(figure, 2).axes
    bars = [(bar.get_x() + bar.get_width() / 2, bar.get_height()) for group in axes.containers for bar in group]
    assert bars == [(0.0, 1.0), (2.0, -1.0), (1.0, 0.5)]


def test_legends_and_tables_name_the_axis_and_all_effects_of_the_model() -> None:
    """With two effects in the model, every figure of it names both; its table has the axis and both effects in the column names."""
    story: Any = document(told())
    for step in story["steps"][1:]:
        step["effects"] = ["coulomb_friction", "cogging"]
    figures = gallery(story)
    for name in ("frequency_response", "error_by_frequency", "error_by_speed", "velocity", "position", "velocity_at_largest_error",
                 "before_and_after", "last_model_fails_by_time"):  # fmt: skip
        names = [str(trace.name).replace("<br>", " ") for trace in figures[name].data if trace.showlegend is not False]
        assert any("with coulomb friction, cogging" in text for text in names), name
    made = written(story, ["csv"], 2, ["velocity", "candidate_effects"])
    assert "axis x, simulated with coulomb friction, cogging: velocity (mm/s)" in made["velocity"]["csv"].decode().splitlines()[0]
    assert made["candidate_effects"]["csv"].decode().splitlines()[0].endswith(': effect"')


def test_a_curve_lies_where_its_numbers_say() -> None:
    """Also on logarithmic axes: a straight line between two decades passes the middle of the figure."""
    figure = go.Figure(go.Scatter(x=[1.0, 100.0], y=[1.0, 100.0], mode="lines", line={"color": "#123456"}))
    figure.update_xaxes(type="log", range=[0, 2])
    figure.update_yaxes(type="log", range=[0, 2])
    drawn = [item.get("d") for item in ET.fromstring(vectors(figure, ["svg"])["svg"]).iter() if "#123456" in (item.get("style") or "")]
    (line,) = [path for path in drawn if path]
    numbers = np.array([float(word) for word in line.replace("M", " ").replace("L", " ").split()]).reshape(-1, 2)
    assert numbers[-1][0] - numbers[0][0] > 300 and numbers[0][1] - numbers[-1][1] > 150


def test_without_matplotlib_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line with the name of the extra."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r"xy_sysid\[figures\]"):
        vectors(go.Figure(), ["svg"])


def test_figures_writes_them_into_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One file for each figure and kind, named by axis and figure; the table has the drawn numbers; a wrong kind is refused."""
    rec = tmp_path / "dry.npz"
    assert cli("simulate", rec, "--machine", "rigid.yaml", "--duration", "4").code == 0
    assert "svg, pdf, csv" in refused("figures", rec, "-o", tmp_path / "out", "--kind", "gif") and not (tmp_path / "out").exists()
    story: Any = document(told())
    monkeypatch.setattr("xy_sysid.report.axis_report.told", lambda recording, axis, library: story)
    said = cli("figures", rec, "-o", tmp_path / "out", "--axis", "x", "--kind", "svg", "--kind", "csv", "--json")
    assert said.code == 0, said.err
    names = said.json["files"]["x"]
    assert sorted(names) == sorted(path.name for path in (tmp_path / "out").iterdir()) and "axis_x_error_ladder.svg" in names
    lines = (tmp_path / "out" / "axis_x_frequency_response.csv").read_text().splitlines()
    assert "axis x, measured, 95 % band: frequency (Hz)" in lines[0]
