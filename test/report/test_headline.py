"""The headline of an axis: one state at a time, from missing to explained, and the next action."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from helpers.stories import RATE, data, told

from xy_sysid.page.plot import plain
from xy_sysid.report.figure_data import table
from xy_sysid.report.headline import detail, headline, next_act
from xy_sysid.report.story_failure import failure, failure_words
from xy_sysid.samples.recording import Run
from xy_sysid.story.document import document
from xy_sysid.story.story import Story, removed


def with_steps(count: int, diagnosed: bool = True) -> dict[str, Any]:
    """The finished story as it was after this many steps."""
    from dataclasses import replace

    story: Story = told()
    return document(replace(story, rungs=story.rungs[:count], pictures=story.pictures[:count], diagnosis=story.diagnosis if diagnosed else None))


def test_the_headline_goes_from_missing_over_adding_to_explained() -> None:
    """One state only: missing, explained, or being added."""
    base, found, grown = with_steps(1, diagnosed=False), with_steps(1), with_steps(2)
    assert headline(None) == "Not fitted yet" and next_act(None) is None
    assert headline(base).startswith("Something is missing: ") and next_act(base) == ("diagnose", "")
    assert headline(found) == headline(base) and next_act(found) == ("add", "coulomb_friction")
    assert headline(found, "adding coulomb friction") == "Adding coulomb friction ..."
    assert headline(grown).startswith("Explained: ") and "→" in headline(grown) and next_act(grown) == ("keep", "")
    words = [headline(item) for item in (base, found, grown)]
    assert all(("missing" in line) != ("Explained" in line) for line in words)
    assert "missing" not in detail(grown).lower() and "at the noise floor" in detail(grown)
    assert "Missing: coulomb_friction" in detail(found) and "Confidence in coulomb friction" in detail(found)
    assert "largest error of the rigid model" in detail(base)


def test_taking_the_effect_out_makes_the_headline_fall_back() -> None:
    """After Remove the model is rigid again, an effect is missing again, and the next action is the same as before."""
    back = document(removed(told(), Run("x", RATE, *data()), "coulomb_friction"))
    assert headline(back).startswith("Something is missing: ") and next_act(back) == ("add", "coulomb_friction")


def test_other_ends_have_a_line_of_their_own() -> None:
    """Nothing missing, part of it explained, nothing in the library, too little data."""
    base, grown = with_steps(1), with_steps(2)
    assert headline({**base, "ladder": []}) == "Not enough data"
    at_floor = {**base["ladder"][0], "explained": True}
    assert headline({**base, "ladder": [at_floor]}).startswith("Nothing is missing: ")
    assert headline({**base, "verdict": "not_in_library", "effects": []}) == "Something is missing that is not in the library"
    half = {**grown["ladder"][1], "explained": False, "excess": 0.5 * base["ladder"][0]["excess"], "held_out_error": 1e-3}
    assert headline({**grown, "ladder": [base["ladder"][0], half]}).startswith("Partly explained: ")
    assert next_act({**grown, "ladder": [base["ladder"][0], half], "note": ""}) == ("next", "")
    assert next_act({**grown, "ladder": [base["ladder"][0], half], "note": "No effect of the library helps any further."}) == ("keep", "")


@pytest.mark.parametrize("by", ["frequency", "speed", "position", "time"])
def test_the_first_picture_shows_where_the_model_fails_and_how_far_it_falls(by: Any) -> None:
    """On one scale: far above the floor before, at the floor after, with the rigid model still behind it."""
    story = with_steps(2)
    before, after = failure(story, by, step=0), failure(story, by)
    assert [trace.name for trace in before.data] == ["this model"] and [trace.name for trace in after.data] == ["rigid", "this model"]
    assert float(np.nanmax(before.data[0].y)) > 5.0 > 2.0 > float(np.nanmax(after.data[-1].y))
    ranges = {tuple(failure(story, other).layout.yaxis.range) for other in ("frequency", "speed", "position", "time")}
    assert ranges == {tuple(before.layout.yaxis.range)}
    assert f"by {by}" in failure_words(story, by) and "times the noise floor" in failure_words(story, by)


def test_the_numbers_of_a_figure_come_as_a_table() -> None:
    """Named by curve and axis with its unit; the numbers are those of the figure."""
    figure = go.Figure(go.Scatter(x=np.array([1.0, 2.0, 4.0]), y=[0.5, None, 2.0], name="model"))
    figure.update_layout(xaxis_title="frequency (Hz)", yaxis_title="error, of the floor")
    lines = table(json.loads(figure.to_json())).splitlines()
    assert lines == ['model: frequency (Hz),"model: error, of the floor"', "1,0.5", "2,", "4,2"]
    drawn = failure(with_steps(2), "frequency")
    for made in (json.loads(drawn.to_json()), plain(drawn)):
        rows = table(made).splitlines()
        assert rows[0].startswith("rigid: frequency (Hz),rigid: error / floor,this model:") and len(rows) == 1 + len(drawn.data[1].x)
        assert float(rows[1].split(",")[3]) == pytest.approx(float(drawn.data[1].y[0]), rel=1e-6)
