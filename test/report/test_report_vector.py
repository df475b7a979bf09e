"""Figures as vectors without a browser: every picture of a story as SVG and PDF, with its words and curves in it."""

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
from xy_sysid.report.gallery import gallery
from xy_sysid.report.vector import vectors
from xy_sysid.story.document import document


def paths(svg: bytes) -> int:
    return sum(1 for item in ET.fromstring(svg).iter() if item.tag.endswith(("path", "use")))


def test_every_picture_of_a_story_becomes_vectors() -> None:
    """All of the gallery, not empty, not a bitmap, and the same bytes each time."""
    figures = gallery(document(told()))
    assert {"ladder", "bode", "candidates", "before_after", "rigid_fails_by_speed", "fails_by_frequency"} <= set(figures)
    for name, figure in figures.items():
        svg = vectors(figure, ["svg"])["svg"]
        assert b"<image" not in svg and paths(svg) > 20, name
    assert vectors(figures["ladder"], ["svg"]) == vectors(figures["ladder"], ["svg"])
    assert vectors(figures["ladder"], ["pdf"])["pdf"][:5] == b"%PDF-"


def test_a_curve_lies_where_its_numbers_say() -> None:
    """On logarithmic axes, too: a straight line between two decades passes the middle of the picture."""
    figure = go.Figure(go.Scatter(x=[1.0, 100.0], y=[1.0, 100.0], mode="lines", line={"color": "#123456"}))
    figure.update_xaxes(type="log", range=[0, 2])
    figure.update_yaxes(type="log", range=[0, 2])
    drawn = [item.get("d") for item in ET.fromstring(vectors(figure, ["svg"])["svg"]).iter() if "#123456" in (item.get("style") or "")]
    (line,) = [path for path in drawn if path]
    numbers = np.array([float(word) for word in line.replace("M", " ").replace("L", " ").split()]).reshape(-1, 2)
    assert numbers[-1][0] - numbers[0][0] > 300 and numbers[0][1] - numbers[-1][1] > 150


def test_without_matplotlib_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line with the extra's name."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r"xy_sysid\[figures\]"):
        vectors(go.Figure(), ["svg"])


def test_figures_writes_them_into_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One file for each picture and kind, named by axis and picture; the table's numbers are those drawn; a wrong kind is refused."""
    rec = tmp_path / "dry.npz"
    assert cli("simulate", rec, "--machine", "rigid.yaml", "--duration", "4").code == 0
    assert "svg, pdf, csv" in refused("figures", rec, "-o", tmp_path / "out", "--kind", "gif") and not (tmp_path / "out").exists()
    story: Any = document(told())
    monkeypatch.setattr("xy_sysid.report.axis_report.told", lambda recording, axis, library: story)
    said = cli("figures", rec, "-o", tmp_path / "out", "--axis", "x", "--kind", "svg", "--kind", "csv", "--json")
    assert said.code == 0, said.err
    names = said.json["files"]["x"]
    assert sorted(names) == sorted(path.name for path in (tmp_path / "out").iterdir()) and "x_ladder.svg" in names
    lines = (tmp_path / "out" / "x_bode.csv").read_text().splitlines()
    assert "measured, 95 % band: frequency (Hz)" in lines[0]
