"""Every available recording of a real machine with the commands that read recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.real_data import data
from helpers.simulated import copied

from campaigns.faults.attack import GOOD
from campaigns.faults.shared import COMMANDS, MORE, RECORDINGS, Shared, told, unnamed
from xy_sysid.imports import load, several
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.recording import Recording


@pytest.fixture(scope="module", autouse=True)
def read_once() -> Iterator[None]:
    """Recordings are cached between commands that read them with the same options."""
    kept: dict[str, Recording] = {}

    def taken(path: Path, reading: Reading, **options: Any) -> Recording:
        how = f"{path} {reading}"
        if how not in kept:
            kept.clear()
            kept[how] = load(path, reading, **options)
        return copied(kept[how])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "load", taken)
        yield


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("row", RECORDINGS, ids=lambda row: row.path)
def test_a_command_answers_or_refuses_in_one_line(row: Shared, name: str, tmp_path: Path) -> None:
    """A short part of each, with a small budget; no traceback, and no warning of numpy."""
    data(row.path)
    found = told(name, row, tmp_path, short=True)
    assert found.outcome in GOOD, found.note


@pytest.mark.parametrize("name", MORE)
def test_the_other_commands_answer_for_one_of_them(name: str, tmp_path: Path) -> None:
    """All the others are in the campaign."""
    row = next(row for row in RECORDINGS if row.path == "tx40/joint1_merged.csv")
    data(row.path)
    found = told(name, row, tmp_path, short=True)
    assert found.outcome in GOOD, found.note


def test_every_file_is_in_the_table() -> None:
    """A new recording must be in campaigns/faults/shared.py with its options."""
    assert unnamed(data("")) == []


def test_a_new_file_is_noticed(tmp_path: Path) -> None:
    """Next to those of the table, and in a separate folder."""
    for name in ("README.md", "emps/emps_train.npz", "joint_state_bags/roblab_hw4/rosbag.db3", "emps/new.csv", "new/a.npz"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
    assert unnamed(tmp_path) == ["emps/new.csv", "new/a.npz"]
