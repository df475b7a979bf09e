"""One noise floor: headline, tiles, ladder, figures and the command compare use the same number, by the same definition."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli

import xy_sysid as xy
from xy_sysid.front_door.simulated_recording import simulate
from xy_sysid.imports import save
from xy_sysid.page.facts import story_facts
from xy_sysid.report import story_figures as draw
from xy_sysid.report.headline import headline
from xy_sysid.report.story_words import size
from xy_sysid.report.words import moved, number
from xy_sysid.samples.recording import Run
from xy_sysid.story.document import document
from xy_sysid.story.story import begin


@pytest.fixture(scope="module")
def run() -> Run:
    return simulate(20.0, effects=["cogging"], machine="rigid.yaml").run("x")


@pytest.fixture(scope="module")
def story(run: Run) -> dict[str, Any]:
    return document(begin(run))


def test_every_picture_averages_to_the_number_of_the_headline(story: dict[str, Any]) -> None:
    """The mean power of the error over the floor in bins of speed, position and time is that of the full data."""
    base = story["ladder"][0]
    ratio = base["held_out_error"] / base["noise_floor"]
    assert ratio > 5 and f"{number(ratio, 2)} times the noise floor" in headline(story)
    for kind in ("speed", "position", "time"):
        bins = np.array(story["steps"][0]["pictures"]["residual"][kind]["error_over_floor"])
        assert np.sqrt(np.mean(bins**2)) == pytest.approx(ratio, rel=0.05), kind
    lines = story["steps"][0]["pictures"]["residual"]["frequency"]["error_over_floor"]
    assert max(lines) > ratio  # the worst band is at least the overall value


def test_tiles_and_compare_have_the_floor_of_the_ladder(story: dict[str, Any], run: Run) -> None:
    """The tile shows this number, and compare finds it within 2 % from its part of the data."""
    floor = story["ladder"][0]["noise_floor"]
    (tile,) = [fact for fact in story_facts(story) if fact.label == "noise floor"]
    assert tile.text == moved(floor, "m/s")
    assert xy.compare(run).noise_floor == pytest.approx(floor, rel=0.02)


def test_commands_report_and_page_say_the_floor_of_the_ladder(story: dict[str, Any], run: Run, tmp_path: Path) -> None:
    """diagnose and refine have it in their documents, diagnose in its sentence if nothing is missing, and the report in its summary."""
    floor = story["ladder"][0]["noise_floor"]
    recording = simulate(20.0, effects=["cogging"], machine="rigid.yaml")
    save(recording, tmp_path / "rec.npz")
    diagnosed = cli("diagnose", tmp_path / "rec.npz", "--axis", "x", "--budget", "0.3", "--json").json["axes"]["x"]
    refined = cli("refine", tmp_path / "rec.npz", "--axis", "x", "--add", "constant_load", "--json").json["axes"]["x"]
    assert [diagnosed["error"]["noise_floor"], *(rung["noise_floor"] for rung in refined["ladder"])] == pytest.approx([floor] * 3, rel=1e-9)
    table = cli("refine", tmp_path / "rec.npz", "--axis", "x", "--add", "constant_load").out
    assert f"floor {1e3 * floor:.4g}" in table
    assert f"the noise floor is {moved(floor, 'm/s')}" in size(story, 1.0)


def test_what_is_held_out_is_shaded_where_it_lies(story: dict[str, Any]) -> None:
    """A third of the record, in stretches all over it, and the figures in time shade exactly these."""
    spans = story["measured"]["time"]["held_out"]
    part = sum(last - first for first, last in spans) / story["seconds"]
    assert len(spans) > 2 and 0.2 < part < 0.45 and spans[0][0] < 0.4 * story["seconds"] < 0.6 * story["seconds"] < spans[-1][1]
    for figure in (draw.velocity(story), draw.position(story), draw.residual_time(story)):
        shaded = {(shape.x0, shape.x1) for shape in figure.layout.shapes if shape.type == "rect" and shape.fillcolor.startswith("rgba(135,149,159")}
        assert {(first, last) for first, last in spans} <= shaded


def test_the_coherence_of_the_recording_is_no_fault_of_the_model(story: dict[str, Any]) -> None:
    """It belongs to a linear response: never red, with a note."""
    (tile,) = [fact for fact in story_facts(story) if fact.label == "linear part"]
    assert tile.good is None and "property of the recording, not of this model" in tile.meaning
