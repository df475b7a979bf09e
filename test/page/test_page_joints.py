"""The page's state of a joint whose name is not valid in a topic: every topic finds its axis, in any order of arrival."""

from __future__ import annotations

import json

import numpy as np

from xy_sysid.live.plain_messages import OK, ArrayMessage, StatusMessage, topic_of
from xy_sysid.page.topics_state import TopicsState

AXIS = "joint-2"


def table(kind: str) -> ArrayMessage:
    return ArrayMessage(topic_of(kind, AXIS), ("line", "frequency,real,imag,coherence,sigma"), (1, 5), np.ones(5))


def test_topics_statuses_and_stories_of_joint_2_are_one_axis() -> None:
    """Arrays on frf/joint_2 alone keep this name; with a status or a story they belong to joint-2."""
    heard = TopicsState()
    heard.array(table("frf"))
    assert heard.axes() == ("joint_2",)
    units = (("input unit", "N m"), ("output unit", "rad"), ("sampling rate (Hz)", "200"))
    heard.status(StatusMessage(f"axis {AXIS}", OK, "well", units), 1.0)
    assert heard.axes() == (AXIS,) and heard.table("frf", AXIS) is not None and heard.units(f"axis {AXIS}") == ("N m", "rad")
    before = heard.version[f"axis {AXIS}"]
    heard.array(table("comparison"))
    assert heard.version[f"axis {AXIS}"] == before + 1 and heard.table("comparison", AXIS) is not None


def test_a_story_is_kept_under_the_name_that_stands_in_it() -> None:
    """Not under that of its topic."""
    heard = TopicsState()
    assert heard.story("joint_2", json.dumps({"axis": AXIS})) == ""
    heard.array(table("frf"))
    assert heard.axes() == (AXIS,) and set(heard.stories) == {AXIS} and f"story {AXIS}" in heard.version
