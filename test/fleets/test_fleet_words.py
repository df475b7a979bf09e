"""One is singular, and a sentence has a subject."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.cli_tools import refused

from xy_sysid.errors import BadInput
from xy_sysid.fleets.estimate import Progress
from xy_sysid.fleets.finding import recordings


def test_one_recording_is_singular() -> None:
    """The line of a run."""
    assert Progress(total=1, done=1).sentence().startswith("1 of 1 recording,")
    assert Progress(total=2, done=1).sentence().startswith("1 of 2 recordings,")


def test_no_recording_is_a_number_of_something(tmp_path: Path) -> None:
    """No path at all, and a folder without recordings."""
    with pytest.raises(BadInput, match=r"^number of paths is 0; allowed: "):
        recordings([])
    with pytest.raises(BadInput) as caught:
        recordings([tmp_path])
    assert str(caught.value).startswith(f"number of recordings in {tmp_path} is 0; allowed: ")


def test_a_missing_table_is_named(tmp_path: Path) -> None:
    """Without -o."""
    assert "PATH or -o is missing; allowed: recordings or folders, and the table's folder." in refused("fleet", tmp_path)
