"""One recording -> one row per axis, with all results, or the reason for missing ones."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import cli, npz, refused
from helpers.simulated import recorded

from xy_sysid.axis.model import STANDARD
from xy_sysid.errors import BadInput
from xy_sysid.fleets.columns import TIMES, columns
from xy_sysid.fleets.naming import Name, Named, Names, name_of, names_from, unused
from xy_sysid.fleets.of_file import Task, rows_of_file
from xy_sysid.fleets.row import Plan, Row, row_of
from xy_sysid.samples.recording import Recording, Run


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded("coulomb_friction=0.15", seconds=10.0)


def test_a_row_has_the_fit_the_diagnosis_and_every_parameter_with_its_interval(recording: Recording) -> None:
    """FRF features, transfer function, verdict, effects, parameters, errors, floor, explained share, confidence, hash of the data."""
    row = row_of(recording, "x", Plan())
    assert row["effects"] == "coulomb_friction" and row["verdict"] == "missing_effect" and row.get("problem") is None
    for name, truth in {"gain": 0.097, "delay": 1.29e-3, "pole": 246.0, "coulomb_friction_coulomb": 0.15}.items():
        assert row[f"{name}_low"] < row[name] < row[f"{name}_high"]
        assert row[name] == pytest.approx(truth, rel=0.005)
    assert row["noise"] <= row["held_out_error"] < row["rigid_error"] and row["explained"] > 0.99
    assert row["tf_gain_low"] < row["tf_gain"] < row["tf_gain_high"] and row["frf_high"] > 200.0
    assert row["data_sha256"] == recording.run("x").digest
    assert set(row) <= {column.name for column in columns()}


def test_an_effect_that_is_followed_has_parameters_though_it_is_not_named(recording: Recording) -> None:
    """A trend compares the same model in every recording, for any diagnosis."""
    row = row_of(recording, "x", Plan(follow=("coulomb_friction", "constant_load")))
    assert row["effects"] == "coulomb_friction" and row["model"] == "coulomb_friction, constant_load"
    assert abs(row["constant_load_load"]) < 0.01 and row["coulomb_friction_coulomb"] == pytest.approx(0.15, rel=0.01)


def test_the_same_file_gives_the_same_row_bit_for_bit(tmp_path: Path) -> None:
    """The work is counted, not timed: only the columns of times differ."""
    path = npz(tmp_path / "a.npz", rows=6_000)
    one, other = ({k: v for k, v in rows_of_file(Task(str(path))).rows[0].items() if k not in TIMES} for _ in range(2))
    assert one == other and len(one) > 40


def test_every_column_says_what_it_is() -> None:
    """Name, unit and meaning of each; every parameter of every effect has three columns; names need no quoting."""
    found = columns()
    assert len({column.name for column in found}) == len(found)
    assert all(column.meaning and column.name.isidentifier() for column in found)
    names = {column.name for column in found}
    for effect in STANDARD.effects.values():
        for item in effect.parameters if effect.category != "base" else ():
            assert {f"{effect.name}_{item.name}{end}" for end in ("", "_low", "_high")} <= names


def test_what_cannot_be_read_is_a_row_that_says_why(tmp_path: Path) -> None:
    """A broken file is a row."""
    broken = tmp_path / "mill-07" / "2026-03-03.csv"
    broken.parent.mkdir()
    broken.write_text("rubbish\n", encoding="utf-8")
    (row,) = rows_of_file(Task(str(broken))).rows
    assert row["machine"] == "mill-07" and row["date"] == datetime(2026, 3, 3, tzinfo=UTC)
    assert row["stage"] == "reading" and row["problem"].startswith("no voltage column")
    (row,) = rows_of_file(Task(str(tmp_path / "gone.csv"))).rows
    assert row["problem"].startswith("cannot be read (No such file or directory)") and row["date"] is None


def test_a_dead_link_or_a_pipe_keeps_the_machine_and_date_of_its_path(tmp_path: Path) -> None:
    """So trend can say that the newest recording of a machine cannot be read."""
    (tmp_path / "m7_2026-03-01.csv").symlink_to("nowhere")
    os.mkfifo(tmp_path / "m7_2026-03-02.csv")
    names = Names(pattern="{machine}_{date}.csv")
    rows = [row for path in sorted(tmp_path.iterdir()) for row in rows_of_file(Task(str(path), names)).rows]
    assert [(row["machine"], row["stage"], row["date"].day) for row in rows] == [("m7", "reading", 1), ("m7", "reading", 2)]


def test_an_axis_that_cannot_be_fitted_keeps_what_is_known_of_it() -> None:
    """The reason is in the row, with all available results."""
    still = Recording.from_arrays(1000.0, np.ones(5000), np.zeros(5000))
    row = row_of(still, "x", Plan())
    assert row["stage"] == "fit" and "constant" in row["problem"]
    assert row["samples"] == 5000 and row["verdict"] == "not_enough_data"


def test_an_error_that_nobody_thought_of_in_one_axis_leaves_the_others_theirs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both axes of a file have a row; that of the faulty axis names the failed stage, and keeps earlier results."""
    from xy_sysid.fleets import row as module

    def diagnosed(recording: Recording, run: Run, plan: Plan) -> Row:
        if run.axis == "x":
            raise IndexError("index 3 is out of bounds")
        return {"verdict": "nothing_missing"}

    monkeypatch.setattr(module, "_diagnosis", diagnosed)
    place = tmp_path / "two.npz"
    u = np.random.default_rng(1).standard_normal((3000, 2))
    np.savez(place, fs=1000.0, u=u, y=np.cumsum(u, axis=0) * 1e-6, axes=np.array(["x", "y"]))
    x, y = rows_of_file(Task(str(place))).rows
    assert x["stage"] == "diagnosis" and x["problem"].startswith("IndexError in diagnosed, line")
    assert "index 3 is out of bounds. This is a fault of xy_sysid" in x["problem"] and x["tf_gain"] > 0.0
    assert y["verdict"] == "nothing_missing" and y.get("problem") is None and x["key"] == y["key"] != ""


@pytest.mark.parametrize(
    ("path", "pattern", "name"),
    [
        ("/data/mill-07/2026-03-03.csv", "", Name("mill-07", "", datetime(2026, 3, 3, tzinfo=UTC))),
        ("/data/mill-07/rosbag2_2026_03_03-14_30_05", "", Name("mill-07", "", datetime(2026, 3, 3, 14, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/run_12.csv", "", Name("mill-07")),
        ("/data/mill-07/SN00012345_run1.csv", "", Name("mill-07")),
        ("/data/mill-07/10002026_2026-03-03.csv", "", Name("mill-07", "", datetime(2026, 3, 3, tzinfo=UTC))),
        ("/data/mill-07/rosbag2_1970_01_01-00_05_12", "", Name("mill-07")),
        ("/data/mill-07/2026-03-03T14-30-05+0200.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 12, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03T14:30:05-05:00.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 19, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03-14:30.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 14, 30, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03T143005-0500.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 19, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03T14-30-0330.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 18, 0, tzinfo=UTC))),
        ("/data/mill-07/20260303T143005+02.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 12, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03T14-30-05+05-30.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 9, 0, 5, tzinfo=UTC))),
        ("/data/mill-07/2026-03-03_143005-0012.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 14, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/SN20440101_2026-03-03.csv", "", Name("mill-07", "", datetime(2026, 3, 3, tzinfo=UTC))),
        ("/data/mill-07/SN20440101_20260303_143005.csv", "", Name("mill-07", "", datetime(2026, 3, 3, 14, 30, 5, tzinfo=UTC))),
        ("/data/mill-07/2026_03_03_SN20440101.csv", "", Name("mill-07", "", datetime(2026, 3, 3, tzinfo=UTC))),
        ("/data/mill-07/rec20260303.csv", "", Name("mill-07", "", datetime(2026, 3, 3, tzinfo=UTC))),
        (
            "/data/mill-07/z/20260303T1430_a.csv",
            "{machine}/{axis}/{date}*",
            Name("mill-07", "z", datetime(2026, 3, 3, 14, 30, tzinfo=UTC), said=True),
        ),
        ("/data/2026-03-03/old/m7.npz", "{date}/*/{machine}.npz", Name("m7", "", datetime(2026, 3, 3, tzinfo=UTC), said=True)),
    ],
)
def test_machine_axis_and_date_come_from_the_path(path: str, pattern: str, name: Name) -> None:
    """By a pattern, or the folder and a date in the name."""
    assert name_of(Path(path), Names(pattern=pattern)) == name


def test_a_small_file_names_what_the_path_does_not_tell(tmp_path: Path) -> None:
    """YAML: a pattern, followed effects, and single recordings."""
    file = tmp_path / "names.yaml"
    file.write_text(
        "pattern: '{machine}/{date}*'\nfollow: [coulomb_friction]\nrecordings:\n  old/a.csv: {machine: mill-01, date: 2025-11-02}\n", encoding="utf-8"
    )
    names = names_from(file)
    assert names.follow == ["coulomb_friction"] and names.recordings["old/a.csv"] == Named(machine="mill-01", date="2025-11-02")
    assert name_of(Path("/x/old/a.csv"), names) == Name("mill-01", "", datetime(2025, 11, 2, tzinfo=UTC), said=True)
    with pytest.raises(BadInput, match="a year from 2000 to 2099"):
        name_of(Path("/x/mill/2206-03-03.csv"), names)
    with pytest.raises(BadInput, match="ends with"):
        name_of(Path("/x/old/b.csv"), names)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{machin: a}", "allowed: machine, axis, date. Did you mean 'machine'?"),
        ("{machine: , date: 2026-01-02}", "machine is None; allowed: text."),
        ("{axis: }", "axis is None; allowed: text."),
        ("text", "recordings.a.csv is 'text'; allowed: names with values."),
        ("{machine: m7, date: 1926-03-03}", "date of a.csv is '1926-03-03'; allowed: a year from 2000 to 2099."),
        ("{machine: m7, date: May}", "date of a.csv is 'May'; allowed: a day and a time of day."),
    ],
)
def test_a_mistake_in_a_file_of_names_is_told_before_any_work(entry: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "names.yaml"
    file.write_text(f"recordings: {{a.csv: {entry}}}", encoding="utf-8")
    assert words in refused("fleet", npz(tmp_path / "a.npz", rows=100), "-o", tmp_path / "table", "--names", file)


def test_an_entry_that_names_no_recording_is_found() -> None:
    """An end of a path begins with the whole name of a folder or file."""
    names = Names(recordings={end: Named(machine="m") for end in ("/x/old/a.csv", "old/a.csv", "a.csv", "ld/a.csv")})
    assert unused(names, [Path("/x/old/a.csv")]) == ("ld/a.csv",)


@pytest.mark.parametrize("pattern", ["{machin}/*", "{machine}/{machine}", "{ machine }/*", "/{machine}/*", "./*.npz", "{machine}/"])
def test_a_pattern_that_means_nothing_is_refused(pattern: str, tmp_path: Path) -> None:
    """In one line, before any work."""
    npz(tmp_path / "a.npz", rows=100)
    assert "pattern is" in refused("fleet", tmp_path, "-o", tmp_path / "table", "--pattern", pattern)


def test_one_recording_that_does_not_exist_is_a_mistake(tmp_path: Path) -> None:
    """A misspelt path in cron is an error; a file that exists and cannot be read is a row."""
    assert "--one is nothere.csv; allowed: a recording that exists" in refused("fleet", "--one", "nothere.csv", "-o", tmp_path / "row.parquet")
    assert not (tmp_path / "row.parquet").exists()


def test_one_recording_is_a_document_or_a_file(tmp_path: Path) -> None:
    """For external engines: one file in, one row per axis out, in this process."""
    path = npz(tmp_path / "2026-03-03.npz", rows=6_000)
    row = cli("fleet", "--one", path).json["rows"][0]
    assert row["axis"] == "x" and row["date"].startswith("2026-03-03") and row["gain"] == pytest.approx(1e-3, rel=0.02)
    assert cli("fleet", "--one", path, "-o", tmp_path / "row.parquet").code == 0
    import pyarrow.parquet

    assert pyarrow.parquet.read_table(tmp_path / "row.parquet").to_pylist()[0]["gain"] == row["gain"]
