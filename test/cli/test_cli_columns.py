"""From any file to an answer: its content, the role of each column, and several recordings at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from helpers.bag_making import a_bag, both
from helpers.cli_tools import RIGID, cli, npz, refused
from helpers.real_data import data
from helpers.table_making import T, U, Y, csv_of

from xy_sysid.imports import load
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.several import joined, read_all


def test_columns_says_what_is_in_a_table_and_what_it_is_taken_for(tmp_path: Path) -> None:
    """Name, unit, rows, range, likely clock, role; how the file is read; the same as JSON."""
    path = csv_of(tmp_path, {"Time": T, "state": ["on"] * len(T), "Motor Voltage (V)": U, "Pos [mm]": 1e3 * Y})
    said = cli("columns", path)
    assert (
        said.code == 0
        and "a clock: even steps of 0.001" in said.out
        and "x.output" in said.out
        and "1000 Hz, 3 s, input in V, output in m" in said.out
    )
    found = cli("columns", path, "--json").json
    assert [(one["name"], one["unit"], one["role"]) for one in found["columns"]] == [
        ("Time", "", "time"),
        ("state", "", ""),
        ("Motor Voltage", "V", "x.input"),
        ("Pos", "mm", "x.output"),
    ]
    assert found["kind"] == "csv" and found["problem"] is None and found["columns"][2]["high"] == pytest.approx(U.max())


def test_columns_of_what_does_not_read_says_how_to_read_it(tmp_path: Path) -> None:
    """The names to be used with --map, among them the likely clock; that command then works."""
    scipy.io.savemat(tmp_path / "a.mat", {"log": np.column_stack((T, Y, U)), "gain": 3.0})
    said = cli("columns", tmp_path / "a.mat")
    assert said.code == 0 and "Needs options to be read" in said.out and "--map time=log:1,input=COLUMN,output=COLUMN" in said.out
    answer = cli("fit", tmp_path / "a.mat", *RIGID, "--set", "length=512", "--map", "time=log:1,input=log:3,output=log:2", "--json").json
    assert answer["axes"]["x"]["converged"]


@pytest.mark.parametrize("kind", ["bag", "npz"])
def test_columns_of_bags_and_arrays(tmp_path: Path, kind: str) -> None:
    """Topics with their columns and counts; arrays of the contract with their roles."""
    path = a_bag(tmp_path / "bag", both(range(0, 400, 20))) if kind == "bag" else npz(tmp_path / "a.npz", rows=600)
    found = cli("columns", path, "--json").json
    assert found["kind"] == kind and found["reads"]
    first = found["columns"][0]
    if kind == "bag":
        assert (first["name"], first["unit"], first["rows"], first["first"]) == ("/xy/voltage", "Float64MultiArray", 20, "seq,time,x,y")
    else:
        assert [one["role"] for one in found["columns"]] == ["time", "input", "output"]
    assert "cannot be read" in refused("columns", tmp_path / "nothing.csv")


@pytest.mark.parametrize("command", ["frf", "fit", "compare", "diagnose", "validate", "refine", "study", "report"])
def test_every_offline_command_has_the_same_options_of_reading(command: str) -> None:
    """--map, --unit, --scale, --rate, --axis, --topic, --effort and --span are the same everywhere."""
    text = cli(command, "--help").out
    for option in ("--map WHAT=COLUMN", "--unit WHAT=UNIT", "--scale WHAT=FACTOR", "--rate HZ", "--axis", "--topic", "--effort", "--span"):
        assert option in text, option


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--map", "input"), "WHAT=VALUE"),
        (("--map", "x.volts=3"), "'x.volts'"),
        (("--map", "input=nothing"), "no array 'nothing'; it has t, u, y"),
        (("--scale", "output=big"), "output=big; allowed: a number"),
        (("--rate", "-1"), "rate is -1"),
        (("--unit", "time=V"), "'V' of the time"),
    ],
)
def test_a_wrong_option_of_reading_is_one_line(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    """The given value, the allowed values, the next action."""
    assert words in refused("frf", npz(tmp_path / "a.npz", rows=600), *options)


def test_units_and_scales_hold_for_bags_too(tmp_path: Path) -> None:
    """Topics of a bag have no unit: --unit and --scale give it; there are no columns to map."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    plain, turned = load(bag), load(bag, units={"output": "deg"}, scales={"input": 2.0})
    assert (turned.output_unit, turned.input_unit) == ("rad", "V")
    np.testing.assert_allclose(turned.position, plain.position * np.pi / 180)
    np.testing.assert_allclose(turned.voltage, 2.0 * plain.voltage)
    assert load(bag, units={"output": "m/s"}).measured == "velocity"
    custom = a_bag(tmp_path / "custom", both(range(0, 400, 20)), custom={"input_unit": "V", "output_unit": "mm"})
    np.testing.assert_allclose(load(custom).position, 1e-3 * plain.position)
    assert "A bag has topics" in refused("frf", bag, "--map", "input=a")


def test_several_recordings_are_read_as_one_with_gaps_between(tmp_path: Path) -> None:
    """frf, fit, compare and report take REC...; notes say which; the answer uses all of them."""
    paths = [npz(tmp_path / f"{name}.npz", rows=9000) for name in "abc"]
    one = cli("frf", paths[0], "--set", "length=1024", "--json").json
    three = cli("frf", *paths, "--set", "length=1024", "--json").json
    assert abs(three["axes"]["x"]["windows"] - 3 * one["axes"]["x"]["windows"]) <= 1  # where windows begin depends on the gaps
    assert three["recording"]["source"] == ", ".join(map(str, paths))
    model = tmp_path / "m.yaml"
    assert cli("fit", *paths, *RIGID, "--set", "length=1024", "--model", model).code == 0
    found = cli("compare", paths[0], paths[1], model, "--set", "length=1024", "--json").json
    assert found["model"] == str(model) and any("2 recordings, one after the other" in note for note in found["notes"])
    assert cli("compare", paths[0], model, "--set", "length=1024", "--json").json["model"] == str(model)


def test_notes_of_several_recordings_say_which(tmp_path: Path) -> None:
    """Each note begins with its file; axes that only some files have are left out, with a note."""
    whole = npz(tmp_path / "a.npz", rows=600)
    table = csv_of(tmp_path, {"time": T, "x_voltage": U, "z_voltage": U, "x_position[mm]": 1e3 * Y, "z_position[mm]": Y})
    first, second = read_all([whole, table], Reading())
    assert first.axes == second.axes == ("x",)
    assert any(note.startswith(f"{table}: ") and "converted from mm" in note for note in second.notes)
    assert any("z is left out" in note for note in second.notes)
    both_of_them = joined([first, second])
    assert len(both_of_them) == 3600 and len(both_of_them.runs()) == 2 and bool(np.all(np.diff(both_of_them.time) > 0))


def test_recordings_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    """Other units, other rates, no axis in common: both are named."""
    good = npz(tmp_path / "a.npz", rows=600)
    assert "V, m in" in refused("fit", good, npz(tmp_path / "b.npz", rows=600, u_unit="A"))
    assert "1000 Hz in" in refused("fit", good, npz(tmp_path / "c.npz", rows=600, rate=500.0))
    assert "x in" in refused("fit", good, csv_of(tmp_path, {"time": T, "left_voltage": U, "left_position": Y}))


def test_the_rate_that_was_given_reaches_the_answer(tmp_path: Path) -> None:
    """A table without time, counts with their length: a fit in two options."""
    path = csv_of(tmp_path, {"Motor Voltage": U, "Pos": np.round(Y / 1e-9)})
    found = cli("fit", path, "--rate", 1000, "--unit", "output=counts", "--scale", "output=1e-9", *RIGID, "--set", "length=512", "--json").json
    assert found["recording"]["sampling_rate_hz"] == 1000.0 and found["recording"]["units"] == {"input": "V", "output": "m"}
    assert found["axes"]["x"]["estimates"]["gain"]["value"] == pytest.approx(1e-3, rel=0.1)


REAL = [
    ("raw_mat/crane_meas1.mat", ("--map", "input=motorinput,output=Motor positie", "--unit", "output=counts", "--span", "0:30")),
    ("raw_mat/hsm150_idf_pos_0.06_1.mat", ("--map", "time=data:1,input=data:6,output=data:3", "--unit", "input=N m,output=rad")),
    ("bam_servo/bam_xl330_sin_time_square_kp800.csv", ()),
    ("bam_servo/bam_xl330_up_and_down_kp100.csv", ()),
]


@pytest.mark.parametrize(("path", "options"), REAL)
def test_files_of_real_machines_are_two_commands_from_a_diagnosis(path: str, options: tuple[str, ...]) -> None:
    """dSPACE struct, matrix with columns, uneven CSV: columns shows the names, diagnose with them answers, in the units of the file."""
    file = data(path)
    listed = cli("columns", file, "--json").json
    names = {one["name"] for one in listed["columns"]}
    for word in options[1:2]:
        assert {pair.partition("=")[2] for pair in word.split(",")} <= names
    found = cli("diagnose", file, *options, "--json")
    assert found.code == 0, found.err
    (answer,) = found.json["axes"].values()
    assert answer["verdict"] in ("missing_effect", "nothing_missing", "not_in_library", "not_enough_data") and answer["sentence"]
    if not options:
        assert any("uneven" in note for note in found.json["notes"])
