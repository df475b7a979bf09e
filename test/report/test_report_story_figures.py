"""Figures of a story: each shows the data of the document, in light and dark mode, for stories of any length."""

from __future__ import annotations

import copy
import json
from functools import cache
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from helpers.stories import told

from xy_sysid.report import story_figures
from xy_sysid.report.theme import INK
from xy_sysid.report.words import number
from xy_sysid.samples.recording import Run
from xy_sysid.story.document import document
from xy_sysid.story.story import begin

OF_A_STEP = sorted(set(story_figures.__all__) - {"ladder", "candidates", "before_after"})


@cache
def story() -> dict[str, Any]:
    """Coulomb friction found and added; converted through JSON, as for a browser or a file."""
    made: dict[str, Any] = json.loads(json.dumps(document(told())))
    return made


@cache
def silent() -> dict[str, Any]:
    """Data without motion."""
    made: dict[str, Any] = json.loads(json.dumps(document(begin(Run("x", 2000.0, np.zeros(20_000), np.zeros(20_000))))))
    return made


def words_in(figure: go.Figure) -> str:
    return " ".join(str(item.text) for item in figure.layout.annotations)


def curve(figure: go.Figure, name: str) -> np.ndarray:
    return np.asarray(next(item for item in figure.data if item.name == name).y, dtype=float)


@pytest.mark.parametrize("mode", ["light", "dark"])
@pytest.mark.parametrize("name", story_figures.__all__)
def test_every_picture_is_drawn_on_both_papers(name: str, mode: str) -> None:
    """At least one curve with numbers, in the text colour of the mode, with narrow margins."""
    figure = getattr(story_figures, name)(story(), mode=mode)
    drawn = [np.asarray(item.x if item.type == "bar" else item.y, dtype=float) for item in figure.data]
    assert drawn and max(np.isfinite(values).sum() for values in drawn) >= 2
    assert figure.layout.template.layout.font.color == INK[mode][0]
    assert figure.layout.margin.l <= 10 and figure.layout.margin.r <= 12
    json.loads(figure.to_json())


@pytest.mark.parametrize("name", story_figures.__all__)
def test_a_story_without_data_gives_its_sentence(name: str) -> None:
    """Without a step there is no curve, but the reason."""
    figure = getattr(story_figures, name)(silent())
    assert not figure.data
    assert "does not move" in words_in(figure).replace("<br>", " ")


@pytest.mark.parametrize("name", OF_A_STEP)
def test_a_step_without_pictures_shows_the_one_before_it(name: str) -> None:
    """Old steps of long stories have no figure data."""
    long = copy.deepcopy(story())
    long["steps"][-1]["pictures"] = None
    shown = getattr(story_figures, name)(long)
    assert shown.to_json() == getattr(story_figures, name)(story(), 0).to_json()


def test_the_ladder_falls_to_the_floor() -> None:
    """The staircase has the numbers of the document in mm/s; the last step has the mark of the floor."""
    figure = story_figures.ladder(story())
    rungs = story()["ladder"]
    held = curve(figure, "held-out error")
    assert held == pytest.approx(np.repeat([1e3 * item["held_out_error"] for item in rungs], 2))
    assert held[-1] < 0.2 * held[0]
    assert curve(figure, "noise floor")[-1] == pytest.approx(1e3 * rungs[-1]["noise_floor"])
    assert "✓" in figure.layout.annotations[-1].text
    assert "coulomb" in figure.layout.xaxis.ticktext[-1]


def test_no_label_of_a_step_is_wider_than_its_step() -> None:
    """A label beyond the edge is not drawn, so long ones are wrapped."""
    changed = copy.deepcopy(story())
    changed["ladder"][-1]["label"] = "with backlash (error one sample ahead)"
    lines = [line for text in story_figures.ladder(changed).layout.xaxis.ticktext for line in text.split("<br>")]
    assert "+ backlash" in lines
    assert max(len(line) for line in lines) <= 14


def test_failing_bands_are_shaded_and_named() -> None:
    """The base fails in a band of frequency: it is shaded, with its size in words; the last step has no shade."""
    figure = story_figures.residual(story(), 0)
    place = next(item for item in story()["steps"][0]["pictures"]["failing"] if item["kind"] == "frequency" and item["to"] > 1.0)
    shades = [item for item in figure.layout.shapes if item.type == "rect"]
    assert shades[0].x1 == pytest.approx(place["to"])
    assert f"{number(place['error_over_floor'], 3)} × floor" in words_in(figure)
    assert not [item for item in story_figures.residual(story()).layout.shapes if item.type == "rect"]


def test_friction_shows_as_a_jump_at_standstill() -> None:
    """The mean error by velocity has opposite signs on both sides of zero for the base, and vanishes for the last step."""
    speed = np.array(story()["steps"][0]["pictures"]["residual"]["speed"]["speed"])
    slow = (np.abs(speed) < 0.02) & (np.abs(speed) > 0.004)
    base = curve(story_figures.residual_speed(story(), 0), "mean error (mm/s)")
    assert np.all(base[slow & (speed > 0)] < -0.5) and np.all(base[slow & (speed < 0)] > 0.5)
    last = curve(story_figures.residual_speed(story()), "mean error (mm/s)")
    assert np.abs(last).max() < 0.1 * np.abs(base).max()


def test_lines_that_are_not_trusted_are_grey_and_leave_the_curve() -> None:
    """Above the excited frequencies there is no curve and no uncertainty band, only grey crosses."""
    figure = story_figures.bode(story())
    trusted = np.array(story()["measured"]["frequency_response"]["trusted"])
    crosses = next(item for item in figure.data if item.name == "not trusted")
    assert len(crosses.x) == int((~trusted).sum()) > 0
    model = next(item for item in figure.data if item.name == "model with coulomb friction")
    assert max(model.x) == pytest.approx(np.array(story()["measured"]["frequency_response"]["frequency"])[trusted].max())


def test_the_measured_response_is_in_millimetres() -> None:
    """60 dB above metres."""
    figure = story_figures.bode(story())
    measured = curve(figure, "measured, 95 % band")
    response = story()["measured"]["frequency_response"]
    assert np.nanmax(measured) == pytest.approx(max(np.array(response["magnitude_db"])[np.array(response["trusted"])]) + 60.0, abs=1e-6)
    assert figure.layout.yaxis.title.text == "dB re 1 mm/V"


def test_candidates_are_ranked_by_what_they_leave() -> None:
    """Bars increase from top to bottom, the named one is marked, and each shows its evidence; numbers of short bars are next to them."""
    bars = story_figures.candidates(story()).data[0]
    rounded = [float(f"{value:.2g}") for value in bars.x]
    assert rounded == sorted(rounded)
    end = float(story_figures.candidates(story()).layout.xaxis.range[1]) / 1.04
    assert [place == "inside" for place in bars.textposition] == [error > 0.5 * end for error in bars.x]
    assert [text for text in bars.text if text.endswith("named")] and all("%" in text for text in bars.hovertext)


def test_before_and_after_lie_over_each_other() -> None:
    """Two steps in one figure: the later one is lower at every frequency where the first fails."""
    figure = story_figures.before_after(story(), 0, -1)
    before, after = (curve(figure, name) for name in ("before: rigid, with delay", "after: with coulomb friction"))
    assert np.all(after[before > 3.0] < before[before > 3.0])


def test_an_unstable_pole_is_shown_as_such() -> None:
    """The right half plane is shaded if it contains a pole."""
    bad = copy.deepcopy(story())
    bad["steps"][-1]["pictures"]["linear"]["poles"].append({"real": 40.0, "imag": 300.0, "frequency": 48.0, "damping": -0.13})
    figure = story_figures.poles_zeros(bad)
    assert any(item.type == "rect" for item in figure.layout.shapes) and "unstable" in words_in(figure)
    poles = next(item for item in figure.data if item.name == "poles")
    assert 300.0 in poles.y and -300.0 in poles.y
