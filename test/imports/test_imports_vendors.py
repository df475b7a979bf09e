"""Exports of vendors' tools, generated here in the same form, and original ones if available."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from helpers.cli_tools import cli, refused
from helpers.real_data import data
from helpers.table_making import RATE, T, U, Y

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import Reading, load
from xy_sysid.imports.listing import listing
from xy_sysid.imports.registry import format_of, sheet_of
from xy_sysid.imports.several import read_all


def scope(path: Path, comma: bool) -> Path:
    """A TwinCAT 3 Scope export: a column of times for each channel, header lines of other widths, and shorter rows for slow channels."""

    def told(value: float) -> str:
        return f"{value:.9g}".replace(".", ",") if comma else f"{value:.9g}"

    lines = ["Name\ta scope", "Starttime of export\t1\tMonday\t10:00", "", "Name\tMAIN.u\tName\tMAIN.angle", "SymbolComment\t\tSymbolComment"]
    lines += ["SampleTime[ms]\t0.5\tSampleTime[ms]\t1", "Unit\tV (Voltage)\tUnit\tdeg (Degree)", ""]
    for row, u in enumerate(np.repeat(U, 2).tolist()):
        slow = f"\t{told(1e3 * T[row])}\t{told(np.rad2deg(Y[row]))}" if row < len(T) else ("\t \t " if row % 2 else "")
        lines.append(f"{told(0.5 * row)}\t{told(u)}{slow}")
    (path / "scope.csv").write_text("\n".join([*lines, "EOF"]) + "\n", "utf-8")
    return path / "scope.csv"


@pytest.mark.parametrize("comma", [False, True])
def test_a_twincat_scope_export_has_a_time_for_each_channel(tmp_path: Path, comma: bool) -> None:
    """The input at 2 kHz is held to the times of the output at 1 kHz, with the units of the file."""
    found = load(scope(tmp_path, comma))
    assert found.sampling_rate == RATE and (found.input_unit, found.output_unit) == ("V", "rad")
    assert np.allclose(found.voltage[:, 0], U, rtol=1e-6) and np.allclose(found.position[:, 0], Y, rtol=1e-6, atol=1e-12)
    assert listing(tmp_path / "scope.csv").kind == "twincat"


@pytest.mark.parametrize(("name", "rows"), [("tc3_default.csv", 21), ("tc3_decimalcomma.csv", 21)])
def test_twincat_scope_exports_as_they_were_found(name: str, rows: int) -> None:
    """All 21 channels, of three rates, each with as many samples as it has."""
    found = listing(data(f"vendor_exports/{name}"))
    sizes = {column.name: column.rows for column in found.columns}
    assert len(sizes) == rows and sizes["func_OS"] == 4996 and sizes["var_REAL64"] == 1000 and sizes["func_freesample"] == 201


def test_a_channel_that_rises_evenly_is_not_the_time_of_others(tmp_path: Path) -> None:
    """Each channel has its own time, so that a counter is an ordinary channel."""
    names = ("MAIN.u", "MAIN.angle", "MAIN.cycle")
    lines = ["\t".join(f"{what}\t{one}" for one in cells) for what, cells in (("Name", names), ("SampleTime[ms]", ("1",) * 3))]
    for row, values in enumerate(zip(U.tolist(), Y.tolist(), (0.2 * np.arange(len(U))).tolist(), strict=True)):
        lines.append("\t".join(f"{1e3 * T[row]:.9g}\t{value:.9g}" for value in values))
    (tmp_path / "scope.csv").write_text("\n".join([*lines, "EOF"]) + "\n", "utf-8")
    found = load(tmp_path / "scope.csv", columns={"input": "MAIN.u", "output": "MAIN.angle"})
    assert found.sampling_rate == RATE and np.allclose(found.position[:, 0], Y, rtol=1e-6, atol=1e-12)


def test_a_codesys_trace_is_read(tmp_path: Path) -> None:
    """Variables in sequence, each with its own samples; the error gives the number of a bad row."""
    head = "[key]; [value]\nVersion; 0x03050000\n"
    parts = [
        f"{place}.Variable; PLC.{name}\n{place}.Class; 14\n{place}.Data; \n"
        + "".join(f"; {1e3 * at:g}; {one!r}\n" for at, one in zip(T, values, strict=True))
        for place, (name, values) in enumerate((("motor_voltage", U.tolist()), ("position", Y.tolist())))
    ]
    path = tmp_path / "a.trace.csv"
    path.write_text(head + "".join(parts), "utf-8")
    found = load(path)
    assert found.sampling_rate == RATE and np.array_equal(found.voltage[:, 0], U) and np.array_equal(found.position[:, 0], Y)
    path.write_text(head + parts[0] + "; 3; what\n", "utf-8")
    with pytest.raises(BadRecording, match="row 3006 is"):
        load(path)


def test_the_ctrlx_step_test_gives_its_gain() -> None:
    """1.075 rpm for each per cent, as published."""
    columns = {"input": "HMI_SP_Local_Automatico", "output": "Velocidad_Scaled"}
    found = load(data("vendor_exports/ctrlx_step.trace.csv"), columns=columns, units={"input": "%", "output": "rpm"})
    speed = np.diff(found.position[:, 0]) * found.sampling_rate * 60 / (2 * np.pi)
    low, high = (found.voltage[:-1, 0] == level for level in (0.25, 0.5))
    gain = float(np.median(speed[high]) - np.median(speed[low])) / 25.0
    assert found.sampling_rate == 50.0 and gain == pytest.approx(1.075, rel=0.02)


def configurator(path: Path, speed: np.ndarray, torque: np.ndarray) -> Path:
    """An MR Configurator graph: two header rows, unused channels, a digital one, a time in ms."""
    lines = ["Axis1", f"Number of sampling data,{len(speed)}", "Sampling time interval(ms),1.0", "Time,Analog 1,Analog 2,Analog 3,Digital 1"]
    lines += ["ms,Servo motor speed,Torque,Not selected,INP"]
    lines += [f"{at:.6f},{v:.6f},{f:.6f},0.000000,2.500000" for at, (v, f) in enumerate(zip(speed.tolist(), torque.tolist(), strict=True))]
    (path / "graph.csv").write_text("\n".join(lines) + "\n", "utf-8")
    return path / "graph.csv"


def test_a_mitsubishi_graph_is_torque_to_speed(tmp_path: Path) -> None:
    """Torque in per cent is the input and speed in r/min the output; the time is in ms, and the in-position bit is neither."""
    path = configurator(tmp_path, 100.0 * np.gradient(Y) / np.std(np.gradient(Y)), 10.0 * U)
    found = load(path)
    assert (found.input_unit, found.output_unit, found.measured, found.sampling_rate) == ("FS", "rad", "velocity", 1000.0)
    assert np.allclose(found.voltage[:, 0], 0.1 * U, atol=1e-7)
    assert [column.name for column in listing(path).columns] == ["time", "Servo motor speed", "Torque", "INP state"]


def test_pulses_by_the_hundred_are_counts(tmp_path: Path) -> None:
    """MR Configurator gives droop pulses singly or in hundreds."""
    path = configurator(tmp_path, Y, U)
    path.write_text(path.read_text("utf-8").replace("Not selected", "Droop pulses (by 100 pls.)").replace(",0.000000,2.5", ",3.000000,2.5"), "utf-8")
    pulses = sheet_of(path, format_of(path)).find("Droop pulses")
    assert pulses.unit == "counts" and set(pulses.values.tolist()) == {300.0}


def test_one_move_in_one_direction_tells_nothing(tmp_path: Path) -> None:
    """Friction, load and inertia cannot be determined from it: a note says so, and diagnose refuses."""
    ramp = np.clip(np.minimum(np.arange(2000) - 300, 1700 - np.arange(2000)) / 300.0, 0.0, 1.0)
    path = configurator(tmp_path, 2000.0 * ramp, 20.0 * np.gradient(ramp) * 300 + 3.0 * (ramp > 0))
    assert any("one move in one direction" in note for note in load(path).notes)
    assert "several moves in both directions" in refused("diagnose", path)
    there_and_back = configurator(tmp_path, 2000.0 * np.concatenate((ramp, -ramp)), np.concatenate((ramp, -ramp)))
    assert not any("one move" in note for note in load(there_and_back).notes)


def test_the_mitsubishi_graph_as_it_was_found() -> None:
    """Two commands: its content, and the refusal."""
    path = data("vendor_exports/mitsubishi_mr.csv")
    assert "Torque" in cli("columns", path).out
    assert "one move in one direction" in refused("diagnose", path)


def test_arrays_of_a_json_log_are_found_by_their_path(tmp_path: Path) -> None:
    """The arrays of all items of a list are stretches of one recording; one item can be chosen; a rate at the top applies."""
    parts = [slice(0, 1000), slice(1000, 1400), slice(1400, 3000)]
    log = {"fs": RATE, "data": [{"kind": "noise", "actions": U[part].tolist(), "sensor": Y[part].tolist()} for part in parts]}
    path = tmp_path / "log.json"
    path.write_text(json.dumps(log), "utf-8")
    found = load(path, columns={"input": "data[*].actions", "output": "data[*].sensor"})
    assert [run.stop - run.start for run in found.runs()] == [1000, 400, 1600] and np.array_equal(found.position[:, 0], Y)
    assert any("3 stretches, one after the other" in note for note in found.notes)
    path.write_text(json.dumps({"fs": RATE, "u": [U[part].tolist() for part in parts], "y": [Y[part].tolist() for part in parts]}), "utf-8")
    lists = load(path, columns={"input": "u[*]", "output": "y[*]"})
    assert [run.stop - run.start for run in lists.runs()] == [1000, 400, 1600] and np.array_equal(lists.voltage[:, 0], U)
    path.write_text(json.dumps(log), "utf-8")
    one = load(path, columns={"input": "data[1].actions", "output": "data[1].sensor"})
    assert np.array_equal(one.voltage[:, 0], U[1000:1400])
    lines = tmp_path / "log.jsonl"
    lines.write_text("\n".join(json.dumps({"t": t, "u": u, "y": y}) for t, u, y in zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)), "utf-8")
    assert np.array_equal(load(lines).position[:, 0], Y)
    path.write_text("{]", "utf-8")
    with pytest.raises(BadRecording, match="not readable as JSON"):
        load(path)


@pytest.mark.parametrize(
    ("ending", "text", "says"),
    [
        ("json", f'{{"t": [1, {10**400}], "u": [1, 2]}}', "a whole number that is too large"),
        ("csv", "Sampling time interval(ms),1\nTime,Analog 1,Analog 2\nms,Torque (%)\n0,1,2\n1,2,3\n", "row 2 names 3 signals, and row 3 2"),
    ],
)
def test_a_damaged_export_is_refused_in_one_line(tmp_path: Path, ending: str, text: str, says: str) -> None:
    """JSON with a number beyond double range; a Mitsubishi graph whose two rows of names differ in width."""
    path = tmp_path / f"a.{ending}"
    path.write_text(text, "utf-8")
    with pytest.raises(BadRecording, match=says):
        load(path)


def test_a_twincat_scope_export_with_a_long_head_is_known(tmp_path: Path) -> None:
    """The comments of many symbols may fill more than the first 4096 bytes."""
    path = scope(tmp_path, comma=False)
    head, found, rest = path.read_text("utf-8").partition("SymbolComment\t")
    path.write_text(f"{head}{found}{'the current of a drive ' * 1000}{rest}", "utf-8")
    assert load(path).input_unit == "V"


def test_input_and_output_in_two_files_are_joined_by_row_or_by_time(tmp_path: Path) -> None:
    """FILE:COLUMN names them, with a note on the method; files of different lengths without a time are refused."""
    one, other = tmp_path / "u.csv", tmp_path / "y.csv"
    np.savetxt(one, U)
    np.savetxt(other, Y)
    reading = Reading(columns={"input": "u.csv:1", "output": "y.csv:1"}, rate=RATE)
    found = load(one, reading)
    assert np.array_equal(found.voltage[:, 0], U) and np.array_equal(found.position[:, 0], Y)
    assert any(note == "u.csv and y.csv are joined row by row" for note in found.notes)
    np.savetxt(other, Y[:-5])
    with pytest.raises(BadRecording, match="different numbers of rows"):
        load(one, reading)
    for path, name, t, values in ((one, "motor", np.arange(2 * len(T)) / (2 * RATE), np.repeat(U, 2)), (other, "angle", T, Y)):
        np.savetxt(path, np.column_stack((t, values)), delimiter=",", header=f"time,{name}", comments="")
    by_time = load(one, columns={"input": "u.csv:motor", "output": "y.csv:angle"}, units={"output": "rad"})
    assert by_time.sampling_rate == RATE and np.array_equal(by_time.voltage[:, 0], U) and np.array_equal(by_time.position[:, 0], Y)
    assert any("joined by their times" in note for note in by_time.notes)


@pytest.mark.parametrize(
    "stamp",
    [
        lambda t: f"{1.8e18 + np.rint(1e9 * t):.0f}",
        lambda t: f"{1.8e15 + np.rint(1e6 * t):.0f}",
        lambda t: f"{1.8e12 + np.rint(1e3 * t):.0f}",
        lambda t: f"{1.8e9 + t:.3f}",
        lambda t: f"2026-03-01T12:00:{t:06.3f}",
        lambda t: f"12:00:{t:06.3f}",
    ],
    ids=["ns", "us", "ms", "s", "date", "clock"],
)
def test_stamps_of_any_kind_join_two_files(tmp_path: Path, stamp: Callable[[float], str]) -> None:
    """They have one origin: a file that begins 5 samples later is not shifted to the start of the other."""
    for name, values, rows in (("u", U, slice(None)), ("y", Y, slice(5, None))):
        lines = [f"{stamp(t)},{value!r}" for t, value in zip(T[rows].tolist(), values[rows].tolist(), strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join([f"time,{name}", *lines, ""]))
    found = load(tmp_path / "u.csv", columns={"input": "u.csv:u", "output": "y.csv:y"})
    assert found.sampling_rate == pytest.approx(RATE, rel=1e-3) and len(found) == len(T) - 5
    assert np.array_equal(found.voltage[:, 0], U[5:]) and np.array_equal(found.position[:, 0], Y[5:])


def test_a_time_that_was_said_is_the_clock_of_its_file(tmp_path: Path) -> None:
    """The time of the other file is found by its name, and the two are joined by their times."""
    twice = np.arange(2 * len(T)) / (2 * RATE)
    for path, name, t, values in (("u.csv", "clk,motor", twice, np.repeat(U, 2)), ("y.csv", "time,angle", T, Y)):
        np.savetxt(tmp_path / path, np.column_stack((t, values)), delimiter=",", header=name, comments="")
    found = load(tmp_path / "u.csv", columns={"time": "u.csv:clk", "input": "u.csv:motor", "output": "y.csv:angle"})
    assert found.sampling_rate == RATE and np.array_equal(found.voltage[:, 0], U) and np.array_equal(found.position[:, 0], Y)
    assert any("joined by their times" in note for note in found.notes)


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_arrays_may_have_stamps_since_1970(tmp_path: Path, kind: str) -> None:
    """Times in ns, as in a table, with a note."""
    content = {"t": np.rint(1.8e18 + 1e9 * T), "u": U, "y": Y}
    path = tmp_path / f"a.{kind}"
    np.savez(path, allow_pickle=False, **content) if kind == "npz" else scipy.io.savemat(path, content)
    found = load(path)
    assert found.sampling_rate == pytest.approx(RATE, rel=1e-3)
    assert any("taken as ns since 1970" in note for note in found.notes)


def test_both_files_may_be_given_as_recordings(tmp_path: Path) -> None:
    """Files with joined columns are one recording, not two."""
    np.savetxt(tmp_path / "u.csv", U)
    np.savetxt(tmp_path / "y.csv", Y)
    said = cli("frf", tmp_path / "u.csv", tmp_path / "y.csv", "--map", "input=u.csv:1,output=y.csv:1", "--rate", "1000")
    assert said.code == 0 and "axis x:" in said.out


def test_raw_data_of_a_klipper_accelerometer_are_an_output_of_acceleration(tmp_path: Path) -> None:
    """In mm/s^2, with the command in a separate file; its power spectra are refused, since they have no phase."""
    acceleration = np.gradient(np.gradient(Y, T), T)
    rows = np.column_stack((T, 1e3 * acceleration, np.zeros((len(T), 2))))
    np.savetxt(tmp_path / "raw.csv", rows, delimiter=",", header="time,accel_x,accel_y,accel_z", comments="#")
    np.savetxt(tmp_path / "command.csv", np.column_stack((T, U)), delimiter=",", header="time,force [N]", comments="")
    found = load(tmp_path / "raw.csv", columns={"input": "command.csv:force", "output": "raw.csv:accel_x"})
    assert (found.measured, found.input_unit, found.output_unit) == ("acceleration", "N", "m")
    again = np.diff(found.position[:, 0], 2) * RATE**2
    assert float(np.corrcoef(again, acceleration[: len(again)])[0, 1]) > 0.99
    (tmp_path / "psd.csv").write_text("freq,psd_x,psd_y,psd_z,psd_xyz\n" + "\n".join(f"{f},1,2,3,6" for f in range(1, 100)) + "\n", "utf-8")
    assert "power spectra without a phase" in refused("fit", tmp_path / "psd.csv")


def test_a_reference_in_another_quantity_is_refused(tmp_path: Path) -> None:
    """A number is no unit, and a length is no angle; degrees of a reference are converted to rad like those of the output."""
    np.savez(tmp_path / "a.npz", t=T, u=U, y=Y, r=np.rad2deg(Y))
    with pytest.raises(BadInput, match="reference=3"):
        load(tmp_path / "a.npz", units={"output": "rad", "reference": "3"})
    with pytest.raises(BadInput, match="reference=mm"):
        load(tmp_path / "a.npz", units={"output": "rad", "reference": "mm"})
    found = load(tmp_path / "a.npz", units={"output": "rad", "reference": "deg"})
    assert found.reference is not None and np.allclose(found.reference[:, 0], Y)


def test_a_note_about_all_recordings_is_said_once(tmp_path: Path) -> None:
    """One note for all of them, another for some with their names; not one for each file."""
    paths = []
    for number in range(6):
        paths.append(tmp_path / f"part{number}.csv")
        names = "time,motor_voltage,position" if number else "time,motor_voltage,position [mm]"
        np.savetxt(paths[-1], np.column_stack((T, U, Y)), delimiter=",", header=names, comments="")
    notes = [note for one in read_all(paths, Reading()) for note in one.notes]
    assert sum("by their names" in note for note in notes) == 1 and any(note.startswith("all 6 recordings: by their names") for note in notes)
    assert any(note.startswith(f"{paths[0]}: ") and "mm" in note for note in notes)
