"""The text below a figure is true for every recording: it names no duration and no place that depends on the recording."""

from __future__ import annotations

import re

import pytest

from xy_sysid.page.failure_card import READING
from xy_sysid.page.picture_card import PICTURES
from xy_sysid.report import captions, story_words

FIXED = {str(name): text for name, text in [*((picture.name, picture.reading) for picture in PICTURES), *READING.items()]}
FIXED |= {name: text for module in (story_words, captions) for name, text in vars(module).items() if name.isupper() and isinstance(text, str)}
OF_ONE_RECORDING = r"half a second|[1-9][\d.]*\s*(?:ms|s|seconds?)\b|friction near|near 0\b|drag at|at the ends|last third|end of the record"


@pytest.mark.parametrize("name", FIXED)
def test_a_fixed_text_says_nothing_that_only_one_recording_shows(name: str) -> None:
    """The length of an excerpt, the place of friction on the axis of speed, and the held-out part are only in the figure."""
    found = re.search(OF_ONE_RECORDING, FIXED[name])
    assert found is None, found
