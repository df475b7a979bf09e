"""What a table keeps, what new rows replace in it, and which recordings are the same."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import npz
from helpers.simulated import recorded

from xy_sysid.errors import BadRecording
from xy_sysid.fleets.finding import recordings
from xy_sysid.fleets.naming import date_within
from xy_sysid.fleets.of_file import Task, rows_of_file
from xy_sysid.fleets.of_paths import Analysis
from xy_sysid.fleets.parts import rows_of_parts
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import merged, read
from xy_sysid.imports import save

DAY = datetime(2026, 3, 3, tzinfo=UTC)


def row(source: str, machine: str = "mill-01", **more: Any) -> Row:
    return {"machine": machine, "axis": "x", "date": DAY, "source": source, "key": f"key of {source}", "file_sha256": f"sha of {source}", **more}


def table(folder: Path, *columns: str) -> list[tuple[Any, ...]]:
    return [tuple(one[name] for name in columns) for one in read(folder).to_pylist()]


def test_parameters_of_effects_of_ones_own_stay_when_others_are_added(tmp_path: Path) -> None:
    """A run without the effect knows nothing of its columns, and they belong to rows that it does not touch."""
    merged(tmp_path, [row("a.npz", own_drag_size=0.5)])
    merged(tmp_path, [row("b.npz", gain=0.1)])
    assert table(tmp_path, "source", "own_drag_size", "gain") == [("a.npz", 0.5, None), ("b.npz", None, 0.1)]
    merged(tmp_path, [row("a.npz", gain=0.2)])
    assert "own_drag_size" not in read(tmp_path).column_names  # nothing is in it any more
    assert read(tmp_path).schema.field("gain").metadata[b"unit"] == b"m/s/V"


def test_a_recording_has_one_place_whatever_its_machine_was_called_before(tmp_path: Path) -> None:
    """The pattern was corrected, or the file could not be read at first: what stood there under the other name is gone."""
    merged(tmp_path, [row("a.npz", machine="x"), row("b.npz", machine="x"), row("other.npz", machine="x-2")])
    merged(tmp_path, [row("a.npz"), row("b.npz")])
    assert table(tmp_path, "machine", "source") == [("mill-01", "a.npz"), ("mill-01", "b.npz"), ("x-2", "other.npz")]
    assert not (tmp_path / "x.parquet").exists()


def test_a_recording_that_was_moved_and_done_by_another_version_is_no_second_one(tmp_path: Path) -> None:
    """Its key is another, and so is its path; content and date are the same."""
    merged(tmp_path, [row("old/a.npz", file_sha256="same")])
    merged(tmp_path, [row("new/a.npz", file_sha256="same"), row("new/b.npz", file_sha256="other")])
    assert table(tmp_path, "source") == [("new/a.npz",), ("new/b.npz",)]


def test_one_file_under_the_names_of_two_axes_is_two_recordings(tmp_path: Path) -> None:
    """In whatever order they come."""
    merged(tmp_path, [row("x.npz", file_sha256="same")])
    merged(tmp_path, [row("y.npz", file_sha256="same", axis="y")])
    assert table(tmp_path, "axis", "source") == [("x", "x.npz"), ("y", "y.npz")]


def test_rows_without_a_date_come_first(tmp_path: Path) -> None:
    merged(tmp_path, [row("a.npz"), row("b.npz", date=None)])
    merged(tmp_path, [row("c.npz", date=None), row("d.npz", machine="mill-00")])
    assert table(tmp_path, "source") == [("d.npz",), ("b.npz",), ("c.npz",), ("a.npz",)]


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    """Of fifty machines it is this one."""
    merged(tmp_path, [row("a.npz"), row("b.npz", machine="mill-02")])
    (tmp_path / "mill-02.parquet").write_bytes(b"PAR1 rubbish")
    for act in (lambda: read(tmp_path), lambda: merged(tmp_path, [row("c.npz", machine="mill-02")])):
        with pytest.raises(BadRecording, match=r"mill-02\.parquet: cannot be read as Parquet .* Remove it"):
            act()


def test_a_recording_is_found_once_and_any_process_finds_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a relative and an absolute path; a process of a cluster has another working directory."""
    (tmp_path / "data").mkdir()
    npz(tmp_path / "data" / "a.npz", rows=300)
    monkeypatch.chdir(tmp_path)
    (found,) = recordings(["data", tmp_path / "data"])
    assert found == tmp_path / "data" / "a.npz"
    task = Analysis(effect_files=("own.py",)).task(Path("data/a.npz"))
    assert task.path == os.fspath(found) and task.effect_files == (os.fspath(tmp_path / "own.py"),)


def test_a_recording_that_names_its_machine_is_of_that_machine(tmp_path: Path) -> None:
    """Better than the folder, in which recordings of many machines may lie."""
    folder = tmp_path / "all"
    folder.mkdir()
    save(replace(recorded("coulomb_friction=0.15", seconds=3.0), machine="mill-07"), folder / "bag")
    (found,) = rows_of_file(Task(str(folder / "bag"))).rows
    assert found["machine"] == "mill-07"


def test_what_is_tried_first_reaches_an_axis_that_the_path_names(tmp_path: Path) -> None:
    """In the file it has another name."""
    save(recorded("coulomb_friction=0.15", seconds=5.0), tmp_path / "z_2026-03-03.npz")
    task = Analysis().task(tmp_path / "z_2026-03-03.npz")
    names = task.names.model_copy(update={"pattern": "{axis}_{date}.npz"})
    (found,) = rows_of_file(replace(task, names=names, first=(("z", ("coulomb_friction",)),))).rows
    assert (found["axis"], found["tried_first"]) == ("z", "coulomb_friction")


@pytest.mark.parametrize("first", [1.7e12, 1.7e18, -5.0])
def test_a_clock_that_tells_no_date_is_none(first: float) -> None:
    """Milliseconds or nanoseconds since 1970, or time before the start."""
    one = recorded("coulomb_friction=0.15", seconds=1.0)
    assert date_within(replace(one, time=one.time + first)) is None


def test_parts_in_a_gap_have_no_row_and_what_comes_after_it_has(tmp_path: Path) -> None:
    """Longer than two parts: the numbers of the parts tell where it was."""

    def gap(content: dict[str, np.ndarray]) -> np.ndarray:
        return content["t"] + np.where(np.arange(content["t"].size) < 2_000, 0.0, 3.2)

    path = npz(tmp_path / "long.npz", rows=4_000, t=gap)
    rows = rows_of_parts(path, 1.0, Analysis())
    assert [one["source"].rpartition("#")[2] for one in rows] == ["0", "1", "5", "6", "7"]
