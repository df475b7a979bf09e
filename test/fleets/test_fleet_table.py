"""Kept and replaced rows of a table, and identity of recordings."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli, npz, refused
from helpers.simulated import recorded

from xy_sysid.bags import POSITION, VOLTAGE, BagWriter
from xy_sysid.bags.reading import Bag
from xy_sysid.errors import BadRecording
from xy_sysid.fleets.finding import recordings
from xy_sysid.fleets.naming import date_within
from xy_sysid.fleets.of_file import Task, rows_of_file
from xy_sysid.fleets.of_paths import Analysis
from xy_sysid.fleets.parts import rows_of_parts
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import Known, merged, read
from xy_sysid.imports import from_table, in_parts, load, save
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.block import Block
from xy_sysid.samples.recording import Recording

DAY = datetime(2026, 3, 3, tzinfo=UTC)


def row(source: str, machine: str = "mill-01", **more: Any) -> Row:
    return {"machine": machine, "axis": "x", "date": DAY, "source": source, "key": f"key of {source}", "file_sha256": f"sha of {source}", **more}


def table(folder: Path, *columns: str) -> list[tuple[Any, ...]]:
    return [tuple(one[name] for name in columns) for one in read(folder).to_pylist()]


def test_parameters_of_effects_of_ones_own_stay_when_others_are_added(tmp_path: Path) -> None:
    """A run without the effect keeps its columns, which belong to other rows."""
    merged(tmp_path, [row("a.npz", own_drag_size=0.5)])
    merged(tmp_path, [row("b.npz", gain=0.1)])
    assert table(tmp_path, "source", "own_drag_size", "gain") == [("a.npz", 0.5, None), ("b.npz", None, 0.1)]
    merged(tmp_path, [row("a.npz", gain=0.2)])
    assert "own_drag_size" not in read(tmp_path).column_names  # it is empty now
    assert read(tmp_path).schema.field("gain").metadata[b"unit"] == b"m/s/V"


def test_a_recording_has_one_place_whatever_its_machine_was_called_before(tmp_path: Path) -> None:
    """After a corrected pattern, or a file that is readable now, the rows with the old name are removed."""
    merged(tmp_path, [row("a.npz", machine="x"), row("b.npz", machine="x"), row("other.npz", machine="x-2")])
    merged(tmp_path, [row("a.npz"), row("b.npz")])
    assert table(tmp_path, "machine", "source") == [("mill-01", "a.npz"), ("mill-01", "b.npz"), ("x-2", "other.npz")]
    assert not (tmp_path / "x.parquet").exists()


def test_a_recording_that_was_moved_and_done_by_another_version_is_no_second_one(tmp_path: Path) -> None:
    """Its key is another, and so is its path; content and date are the same."""
    merged(tmp_path, [row("old/a.npz", file_sha256="same")])
    merged(tmp_path, [row("new/a.npz", file_sha256="same"), row("new/b.npz", file_sha256="other")])
    assert table(tmp_path, "source") == [("new/a.npz",), ("new/b.npz",)]


def test_a_copy_in_the_same_run_is_no_second_recording(tmp_path: Path) -> None:
    """Their keys differ if the effects of one are tried first in the other. Another date makes another recording."""
    merged(tmp_path, [row("a.npz", file_sha256="same"), row("copy.npz", file_sha256="same"), row("later.npz", file_sha256="same", date=None)])
    assert table(tmp_path, "source") == [("later.npz",), ("copy.npz",)]


def test_one_file_under_the_names_of_two_axes_is_two_recordings(tmp_path: Path) -> None:
    """In any order of arrival."""
    merged(tmp_path, [row("x.npz", file_sha256="same")])
    merged(tmp_path, [row("y.npz", file_sha256="same", axis="y")])
    assert table(tmp_path, "axis", "source") == [("x", "x.npz"), ("y", "y.npz")]


def test_rows_without_a_date_come_first(tmp_path: Path) -> None:
    merged(tmp_path, [row("a.npz"), row("b.npz", date=None)])
    merged(tmp_path, [row("c.npz", date=None), row("d.npz", machine="mill-00")])
    assert table(tmp_path, "source") == [("d.npz",), ("b.npz",), ("c.npz",), ("a.npz",)]


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    """The error names this one of fifty machines."""
    merged(tmp_path, [row("a.npz"), row("b.npz", machine="mill-02")])
    (tmp_path / "mill-02.parquet").write_bytes(b"PAR1 rubbish")
    for act in (lambda: read(tmp_path), lambda: merged(tmp_path, [row("c.npz", machine="mill-02")])):
        with pytest.raises(BadRecording, match=r"mill-02\.parquet: cannot be read as Parquet .* move it away and run xy-sysid fleet again"):
            act()


@pytest.mark.parametrize("name", ["m" * 250, "\u65e5" * 90, "mill\udcff", "." * 250, "a/b"])
def test_any_name_of_a_machine_has_a_file(name: str, tmp_path: Path) -> None:
    """A long name, one in another script, and a folder's name that is not UTF-8; names with the same beginning have different files."""
    merged(tmp_path, [row("a.npz", machine=name), row("b.npz", machine=f"{name}2"), row("c.npz")])
    merged(tmp_path, [row("a.npz", machine=name)])
    assert sorted(table(tmp_path, "source")) == [("a.npz",), ("b.npz",), ("c.npz",)]
    assert len(list(tmp_path.glob("*.parquet"))) == 3


def test_a_damaged_file_of_a_machine_does_not_keep_the_others_out_of_the_table(tmp_path: Path) -> None:
    """Machines before and after it in the alphabet have their rows, and the error names the file."""
    (tmp_path / "mill-02.parquet").write_bytes(b"PAR1 rubbish")
    with pytest.raises(BadRecording, match=r"mill-02\.parquet"):
        merged(tmp_path, [row(f"{number}.npz", machine=f"mill-0{number}") for number in (1, 2, 3)])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mill-01.parquet", "mill-02.parquet", "mill-03.parquet"]


def test_a_recording_is_found_once_and_any_process_finds_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By relative and absolute path; a process of a cluster has another working directory."""
    (tmp_path / "data").mkdir()
    npz(tmp_path / "data" / "a.npz", rows=300)
    monkeypatch.chdir(tmp_path)
    (found,) = recordings(["data", tmp_path / "data"])
    assert found == tmp_path / "data" / "a.npz"
    task = Analysis(effect_files=("own.py",)).task(Path("data/a.npz"))
    assert task.path == os.fspath(found) and task.effect_files == (os.fspath(tmp_path / "own.py"),)


def test_the_folder_of_the_recordings_is_not_that_of_the_table(tmp_path: Path) -> None:
    """The error names -o, not missing recordings; the table's folder among others is passed over."""
    npz(tmp_path / "a.npz", rows=300)
    assert f"-o is {tmp_path}; allowed: another folder than that of the recordings" in refused("fleet", tmp_path, "-o", tmp_path)
    (tmp_path / "table").mkdir()
    assert recordings([tmp_path / "a.npz", tmp_path / "table"], tmp_path / "table") == (tmp_path / "a.npz",)


def test_a_recording_that_names_its_machine_is_of_that_machine(tmp_path: Path) -> None:
    """It takes precedence over the folder, which may hold recordings of many machines."""
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
    """A gap longer than two parts: the numbers of the parts show where it was."""

    def gap(content: dict[str, np.ndarray]) -> np.ndarray:
        return content["t"] + np.where(np.arange(content["t"].size) < 2_000, 0.0, 3.2)

    path = npz(tmp_path / "long.npz", rows=4_000, t=gap)
    rows = rows_of_parts(path, 1.0, Analysis())
    assert [one["source"].rpartition("#")[2] for one in rows] == ["0", "1", "5", "6", "7"]


def test_a_recording_is_compared_with_few_others_however_many_have_its_name() -> None:
    """Each task gets only its possible keys; by file name alone, 10,000 folders with one rec.csv each would need 100 million."""
    rows = [row(f"/data/{day}/rec.csv") for day in range(1000)]
    there = [Path(f"/data/{day}/rec.csv") for day in range(1001)]
    known = Known(rows, {str(path) for path in there})
    assert [known.of(path) for path in there] == [*(frozenset({f"key of /data/{day}/rec.csv"}) for day in range(1000)), frozenset()]
    moved = [Path(f"/archive/{day}/rec.csv") for day in range(1000)]
    known = Known(rows, {str(path) for path in moved})
    assert all(known.of(path) == {f"key of /data/{day}/rec.csv"} for day, path in enumerate(moved))
    alone = Path("/new/place/rec.csv")
    assert len(Known(rows, {str(alone)}).of(alone)) == 1000, "whichever it was, it is not done again"


@pytest.mark.parametrize("ending", [".npz", ".csv", ".mcap", ""])
@pytest.mark.parametrize("reading", [Reading(), Reading(start=0.4, stop=5.2)], ids=["whole", "cut"])
def test_every_part_is_what_reading_it_alone_gives_and_is_read_once(
    ending: str, reading: Reading, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bit for bit, with the same notes. Reading each part from the start would take a day of a recording of a day."""
    volts = np.random.default_rng(3).standard_normal((6_500, 1))
    path = tmp_path / f"long{ending}"
    save(Recording.from_arrays(1000.0, volts, np.cumsum(volts, axis=0) * 1e-6, axes=("x",)), path)
    opened: list[object] = []

    def counted(make: Callable[..., Any]) -> Callable[..., Any]:
        def made(*words: Any) -> Any:
            opened.append(words)
            return make(*words)

        return made

    monkeypatch.setattr(in_parts, "Bag", counted(Bag))
    monkeypatch.setattr(in_parts, "from_table", counted(from_table))
    found = dict(in_parts.in_parts(path, reading, 1.0))
    assert len(opened) == 1
    assert list(found) == list(range(7 if reading.stop is None else 5))
    for number, part in found.items():
        stop = min(reading.start + number + 1.0, reading.stop or 99.0)
        alone = load(path, replace(reading, start=reading.start + number, stop=stop))
        assert part.run("x").digest == alone.run("x").digest and part.notes == alone.notes and np.array_equal(part.time, alone.time)


def blocks(path: Path, order: list[int]) -> Path:
    """A bag of blocks of 20 ms in this order; the voltage is the sample number."""
    with BagWriter(path) as bag:
        for place, number in enumerate(order):
            seq = np.arange(20 * number, 20 * number + 20, dtype=np.float64)
            for topic, values in ((VOLTAGE, seq), (POSITION, np.sin(seq))):
                bag.write_block(topic, Block(("x",), seq, seq / 1000.0, values[:, None]), int(2e7 * (place + 1)))
    return path


def test_where_the_source_starts_anew_a_part_begins(tmp_path: Path) -> None:
    """Its clock and its counter restart; no part contains samples from both sides."""
    found = list(in_parts.in_parts(blocks(tmp_path / "twice", [*range(125), *range(125)]), Reading(), 1.0))
    assert [len(part) for _, part in found] == [1000, 1000, 500, 1000, 1000, 500]
    assert np.array_equal(found[0][1].voltage[:, 0], np.arange(1000.0)) and np.array_equal(found[3][1].voltage, found[0][1].voltage)


def test_a_block_that_comes_late_is_no_start_of_a_part(tmp_path: Path) -> None:
    """A message delayed by a second: the following parts are the same as without it."""
    path = blocks(tmp_path / "late", [*range(60), *range(61, 125), 60, *range(125, 250)])
    found = dict(in_parts.in_parts(path, Reading(), 1.0))
    assert [len(part) for part in found.values()] == [1000, 1000, 1000, 1000, 1000]
    assert np.array_equal(found[4].voltage[:, 0], np.arange(4000.0, 5000.0))


def test_parts_are_named_and_analysed_as_the_options_say(tmp_path: Path) -> None:
    """--names and --effect-file apply to a long recording; for a table they are refused."""
    path, names = npz(tmp_path / "long.npz", rows=6_000), tmp_path / "names.yaml"
    names.write_text("follow: [coulomb_friction]\nrecordings:\n  long.npz: {machine: mill-09, date: 2026-03-03}\n", encoding="utf-8")
    own = tmp_path / "own.py"
    lines = (
        "from dataclasses import replace",
        "from xy_sysid.axis.model import STANDARD",
        "EFFECT = replace(STANDARD['coulomb_friction'], name='own')",
    )
    own.write_text("\n".join(lines), encoding="utf-8")
    said = cli("trend", path, "--every", "1s", "--names", names, "--effect-file", own, "--json").json
    assert said["axes"][0]["machine"] == "mill-09"
    followed = next(one for one in said["parameters"] if one["parameter"] == "coulomb_friction_coulomb")
    assert followed["dates"][0].startswith("2026-03-03")
    assert "without --every" in refused("trend", tmp_path, "--names", names)
