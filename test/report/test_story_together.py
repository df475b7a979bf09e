"""Several recordings and models in one figure."""

from __future__ import annotations

import copy
import json
from functools import cache
from typing import Any

import numpy as np
import plotly.graph_objects as go
from helpers.stories import told

from xy_sysid.report.story_together import Entry, together
from xy_sysid.report.theme import axis_colour
from xy_sysid.story.document import document


@cache
def story() -> dict[str, Any]:
    made: dict[str, Any] = json.loads(json.dumps(document(told())))
    return made


def turned() -> dict[str, Any]:
    """The same machine, with the phase lower by one turn and twice the gain."""
    made = copy.deepcopy(story())
    response = made["measured"]["frequency_response"]
    for name in ("phase_deg", "phase_low_deg", "phase_high_deg"):
        response[name] = [value - 360.0 for value in response[name]]
    response["magnitude_db"] = [value + 6.0 for value in response["magnitude_db"]]
    for step in made["steps"]:
        model = step["pictures"]["frequency_response"]
        model["phase_deg"] = [value - 360.0 for value in model["phase_deg"]]
    return made


def rows_of(figure: go.Figure, name: str) -> list[np.ndarray]:
    return [np.asarray(item.y, dtype=float) for item in figure.data if item.legendgroup == name and item.name == name]


def test_each_axis_has_a_colour_and_each_model_a_dash_of_it() -> None:
    """Two recordings, every model of the second: both responses, and an error for each model."""
    steps = tuple(range(len(story()["steps"])))
    figure = together([Entry("before, x", story(), (0,)), Entry("after, x", turned(), steps)])
    named = {item.name: item.line.color for item in figure.data if item.showlegend}
    assert named["before, x"] == axis_colour(0)
    assert named["after, x"] == axis_colour(1)
    models = [name for name in named if name.startswith("after, x: ")]
    assert len(models) == len(steps) > 1
    assert all(named[name] == axis_colour(1) for name in models)
    assert all(len(rows_of(figure, name)) == 3 for name in models)
    assert "error / floor" in str(figure.layout.yaxis3.title.text)


def test_phases_that_are_whole_turns_apart_lie_on_each_other() -> None:
    """Phases are shifted by whole turns; levels are unchanged."""
    figure = together([Entry("a", story()), Entry("b", turned())])
    (level, phase), (higher, same) = rows_of(figure, "a"), rows_of(figure, "b")
    assert np.nanmax(np.abs(phase - same)) < 1e-9
    assert np.nanmedian(higher - level) == 6.0


def test_nothing_chosen_says_what_to_do() -> None:
    """No empty axes."""
    assert "Choose" in " ".join(str(item.text) for item in together([]).layout.annotations)


def test_a_name_from_a_file_is_no_markup() -> None:
    """The name of a file is shown as text."""
    figure = together([Entry("<b>x</b>", story())])
    assert all("<b>" not in str(item.name) for item in figure.data)
