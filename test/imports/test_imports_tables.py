"""CSV, NPZ and MAT: saved data are recovered, and other files are read or refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from helpers.bag_making import a_recording, assert_same
from helpers.table_making import csv_of

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import load, save
from xy_sysid.samples.recording import Recording

ENDINGS = pytest.mark.parametrize("ending", ["csv", "npz", "mat"])
T = np.arange(200) / 1000.0
U, Y = np.sin(T * 50), np.cos(T * 50)


def written(path: Path, text: str) -> Path:
    file = path / "data.csv"
    file.write_text(text, "utf-8")
    return file


def error_of(path: Path, **options: Any) -> str:
    with pytest.raises(BadRecording) as caught:
        load(path, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@ENDINGS
@pytest.mark.parametrize("axes", [("x",), ("x", "y"), ("carriage", "table", "spindle", "fourth")])
def test_what_was_saved_comes_back(tmp_path: Path, ending: str, axes: tuple[str, ...]) -> None:
    """Plain, with gaps, with a counter, with a reference and other units: the same in every bit."""
    whole = a_recording(600, axes)
    save(whole, tmp_path / f"a.{ending}")
    assert_same(load(tmp_path / f"a.{ending}"), whole)
    keep = np.r_[0:100, 137:600]
    other = Recording(
        2000.0, axes, whole.seq[keep] + 10**10, whole.time[keep] + 1.7e9, whole.voltage[keep], whole.position[keep], "A", "rad", whole.voltage[keep]
    )
    save(other, tmp_path / f"b.{ending}")
    loaded = load(tmp_path / f"b.{ending}")
    assert_same(loaded, other)
    assert loaded.source == str(tmp_path / f"b.{ending}")


@ENDINGS
def test_a_part_and_an_axis_can_be_taken(tmp_path: Path, ending: str) -> None:
    """start, stop and axes work on every kind of file."""
    save(a_recording(4000), tmp_path / f"a.{ending}")
    part = load(tmp_path / f"a.{ending}", start=0.5, stop=1.0, axes=["y"])
    assert (part.axes, len(part), part.time[0]) == (("y",), 1000, 0.5)
    with pytest.raises(BadInput, match="allowed: x, y"):
        load(tmp_path / f"a.{ending}", axes=["z"])


@pytest.mark.parametrize(
    ("head", "separator"),
    [
        ("time,x_voltage,x_position[mm]", ","),
        ("time;x_voltage;x_position (mm)", ";"),
        ("time [ms]\tx_voltage [mV]\tx_position[µm]", "\t"),
        ('"time","x_voltage","x_position[mm]"', ","),
        ("t, u, y [mm]", ","),
        ("time,voltage,position[mm]", ","),
        ("\ufefftime,x_voltage,x_position[mm]", ","),
        ("# a comment\n\ntime,x_voltage,x_position[mm],", ","),
    ],
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_units_and_separators_of_a_csv(tmp_path: Path, head: str, separator: str, decimal: str) -> None:
    """Units in the header are converted to SI with a note; comma, semicolon, tab and a decimal comma are accepted."""
    if separator == decimal:
        pytest.skip("a comma cannot be both")
    milli = "ms" in head
    columns = (T * (1000 if milli else 1), U * (1000 if milli else 1), Y * (1e6 if milli else 1e3))
    rows = [separator.join(f"{value:.17g}".replace(".", decimal) for value in row) for row in zip(*columns, strict=True)]
    recording = load(written(tmp_path, "\n".join([head, *rows])))
    assert (recording.axes, recording.sampling_rate, recording.output_unit, recording.input_unit) == (("x",), 1000.0, "m", "V")
    np.testing.assert_allclose(recording.position[:, 0], Y, rtol=1e-15)
    np.testing.assert_allclose(recording.voltage[:, 0], U, rtol=1e-15)
    assert any("converted from" in note for note in recording.notes)


def test_a_unit_that_is_not_known_is_carried(tmp_path: Path) -> None:
    """N or rad are kept as units."""
    recording = load(written(tmp_path, "time,x_input[N],x_output[rad]\n0,1,2\n0.1,3,4\n0.2,5,6\n"))
    assert (recording.input_unit, recording.output_unit, recording.sampling_rate) == ("N", "rad", 10.0)


def test_missing_cells_become_gaps(tmp_path: Path) -> None:
    """The row of an empty cell or nan is left out and counted."""
    rows = [f"{i / 100},{i},{i}" for i in range(50)]
    rows[10], rows[20] = "0.1,,10", "0.2,20,nan"
    recording = load(written(tmp_path, "time,u,y\n" + "\n".join(rows)))
    assert len(recording) == 48 and len(recording.runs()) == 3
    assert any("2 rows are not numbers" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,u,y\n0,1,2\n0.1,oops,3\n", "row 3, column 'u': 'oops' is not a number"),
        ("# c\n\ntime,u,y\n0,1,2\n0.1,3\n", "row 5 has 2 columns, the first row 3"),
        ("time,u,y\n0,1,2\n0.1,3,4,5\n", "row 3 has 4 columns"),
        ("time,u,y\n", "0 samples"),
        ("time,u,y\n0,1,2\n", "1 samples"),
        ("\n# only this\n", "no rows"),
        ("0,1,2\n0.1,3,4\n", "no voltage column; it has 1, 2, 3"),
        ("u,y\n1,2\n3,4\n", "no time column"),
        ("time,u\n0,1\n1,2\n", "no position column"),
        ("time,x_voltage,y_position\n0,1,2\n1,2,3\n", "no axis has both"),
        ("time,u,u\n0,1,2\n1,2,3\n", "'u' is there twice"),
        ("time,x_u[V],y_u[A],x_y,y_y\n0,1,2,3,4\n1,2,3,4,5\n", "different units (A, V)"),
        ("time,u,y\n0,1,2\n0.1,1,2\n0.2,1,2\n0.05,1,2\n0.3,1,2\n", "time falls back"),
        ("time,u,y\n5,1,2\n5,1,2\n5,1,2\n", "median time step"),
    ],
)
def test_a_csv_that_cannot_be_read_says_where(tmp_path: Path, text: str, says: str) -> None:
    """One line with the row, the column and the content."""
    assert says in error_of(written(tmp_path, text))


def test_csv_columns_can_be_named(tmp_path: Path) -> None:
    """Other names for input and output are arguments, alone or per axis."""
    path = written(tmp_path, "time,x_current[A],x_angle[rad],motor\n0,1,2,7\n0.1,3,4,8\n0.2,5,6,9\n")
    recording = load(path, columns={"input": "current", "output": "angle"})
    assert (recording.axes, recording.input_unit) == (("x",), "A")
    assert load(path, columns={"input": "motor", "output": "x_angle"}).voltage[:, 0].tolist() == [7, 8, 9]
    assert "no column 'torque'" in error_of(path, columns={"input": "torque"})


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_names_and_shapes_of_arrays(tmp_path: Path, ending: str) -> None:
    """t or time, u or voltage, y or position, rows or columns, one axis or several, with units."""

    def loaded(**content: Any) -> Recording:
        path = tmp_path / f"a.{ending}"
        np.savez(path, allow_pickle=False, **content) if ending == "npz" else scipy.io.savemat(path, content)
        return load(path)

    one = loaded(t=T, u=U, y=Y * 1000, y_unit="mm", fs=1000.0)
    assert (one.axes, one.sampling_rate, one.output_unit) == (("x",), 1000.0, "m")
    np.testing.assert_allclose(one.position[:, 0], Y)
    assert loaded(time=T[:, None], voltage=U[None, :], position=Y).voltage.shape == (200, 1)
    two = loaded(t=T, u=np.array([U, Y]), y=np.column_stack((Y, U)), u_unit="A", y_unit="rad")
    assert (two.axes, two.input_unit, two.output_unit) == (("x", "y"), "A", "rad")
    np.testing.assert_array_equal(two.voltage[:, 1], two.position[:, 0])
    untimed = loaded(u=U, y=Y, fs=500)
    assert untimed.sampling_rate == 500 and any("fs = 500 Hz" in note for note in untimed.notes)
    both_given = loaded(t=T, u=U, y=Y, fs=900.0)
    assert both_given.sampling_rate == 1000.0 and any("stamps are taken" in note for note in both_given.notes)
    closed = loaded(t=T, u=U, y=Y, r=Y + 1)
    assert closed.reference is not None and np.array_equal(closed.reference[:, 0], Y + 1)
    gap = loaded(t=np.delete(T, slice(50, 60)), u=np.delete(U, slice(50, 60)), y=np.delete(Y, slice(50, 60)))
    assert len(gap.runs()) == 2 and gap.seq[50] == 60


def test_a_matlab_struct_is_opened(tmp_path: Path) -> None:
    """A single struct in a .mat file is opened."""
    scipy.io.savemat(tmp_path / "a.mat", {"measurement": {"t": T, "u": U, "y": Y, "u_unit": "V"}})
    assert load(tmp_path / "a.mat").sampling_rate == 1000.0


def test_jitter_in_the_time_is_no_gap(tmp_path: Path) -> None:
    """Times with jitter and without losses give one run and the mean rate."""
    jitter = np.random.default_rng(4).uniform(-0.45e-3, 0.45e-3, 200)
    np.savez(tmp_path / "a.npz", t=T + jitter, u=U, y=Y)
    recording = load(tmp_path / "a.npz")
    assert len(recording) == 200 and len(recording.runs()) == 1 and any("jitters" in note for note in recording.notes)
    assert recording.sampling_rate == pytest.approx(1000.0, rel=2e-3)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({"t": T, "u": U}, "no position array; it has t, u"),
        ({"t": T, "u": U, "y": Y[:-1]}, "lengths differ"),
        ({"u": U, "y": Y}, "neither a time column nor a usable fs"),
        ({"u": U, "y": Y, "fs": -3.0}, "neither a time column nor a usable fs"),
        ({"t": T, "u": U * 1j, "y": Y}, "not real numbers"),
        ({"t": T, "u": np.zeros((2, 2, 2)), "y": Y}, "3 dimensions"),
        ({"t": T, "u": np.column_stack((U, U)), "y": Y}, "u has 2 axes and y 1"),
        ({"t": T * np.nan, "u": U, "y": Y}, "0 samples"),
        ({"t": T, "u": np.array(["a"] * 200), "y": Y}, "not real numbers"),
    ],
)
def test_arrays_that_are_no_recording_are_one_line(tmp_path: Path, content: dict[str, Any], says: str) -> None:
    """The error names the missing or wrong item."""
    np.savez(tmp_path / "a.npz", allow_pickle=False, **content)
    assert says in error_of(tmp_path / "a.npz")


def test_files_that_are_none_are_one_line(tmp_path: Path) -> None:
    """Empty, truncated, of another kind, a pickle, a MATLAB 7.3 file of zeros: each error names the cause."""
    save(a_recording(500), tmp_path / "good.npz")
    save(a_recording(500), tmp_path / "good.mat")
    for ending in ("npz", "mat"):
        whole = (tmp_path / f"good.{ending}").read_bytes()
        for part in (0.01, 0.2, 0.7, 0.99):
            (tmp_path / f"cut.{ending}").write_bytes(whole[: int(part * len(whole))])
            assert error_of(tmp_path / f"cut.{ending}")
        (tmp_path / f"text.{ending}").write_text("not this " * 100)
        assert f"not readable as .{ending}" in error_of(tmp_path / f"text.{ending}")
    for ending in ("csv", "npz", "mat"):
        (tmp_path / f"empty.{ending}").touch()
        assert "0 bytes" in error_of(tmp_path / f"empty.{ending}")
        assert "No such file" in error_of(tmp_path / f"nowhere.{ending}")
    np.savez(tmp_path / "pickle.npz", t=np.array([{}], dtype=object), u=U, y=Y)
    assert "not readable" in error_of(tmp_path / "pickle.npz")
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(1000))
    assert "not readable as .mat" in error_of(tmp_path / "new.mat")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)) * 10)
    assert "not a text file" in error_of(tmp_path / "binary.csv")
    with pytest.raises(BadInput, match="file ending"):
        save(a_recording(10), tmp_path / "a.xlsx")


@pytest.mark.parametrize("kind", ["csv", "npz"])
def test_the_units_of_axes_that_are_left_out_do_not_matter(kind: str, tmp_path: Path) -> None:
    """One axis of a robot is chosen and its unit is given: the units of the others do not matter."""
    if kind == "csv":
        path = csv_of(tmp_path, {"time": T, "x_u": U, "y_u": U, "x_y": Y, "y_y": 2 * Y})
    else:
        path = tmp_path / "two.npz"
        np.savez(path, t=T, u=np.column_stack((U, U)), y=np.column_stack((Y, 2 * Y)), r=np.column_stack((Y, 3 * Y)))
    recording = load(path, axes=["y"], units={"y.output": "rad"})
    assert (recording.axes, recording.output_unit) == (("y",), "rad")
    assert np.array_equal(recording.position[:, 0], 2 * Y)
    assert kind == "csv" or (recording.reference is not None and np.array_equal(recording.reference[:, 0], 3 * Y))
    with pytest.raises(BadRecording, match="choose axes of one unit with --axis"):
        load(path, units={"y.output": "rad"})
    with pytest.raises(BadInput, match="allowed: x, y"):
        load(path, axes=["z"], units={"y.output": "rad"})
