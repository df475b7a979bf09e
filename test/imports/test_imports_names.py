"""Any table: columns are recognised in any spelling, or as given by the user; notes name the guesses, and errors ask for unknown ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from helpers.table_making import RATE, T, U, Y, csv_of

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import load
from xy_sysid.imports.foreign_units import unit_of
from xy_sysid.imports.names import header, meaning
from xy_sysid.imports.reading import pairs
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording


def assert_the_axis(recording: Recording, axis: str = "x") -> None:
    """Assert that the recording has the written data, in SI."""
    assert recording.axes == (axis,) and recording.sampling_rate == RATE
    np.testing.assert_allclose(recording.voltage[:, 0], U, rtol=1e-12)
    np.testing.assert_allclose(recording.position[:, 0], Y, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("time", "voltage", "position", "axis"),
    [
        ("Time", "Motor Voltage (V)", "Encoder Pos [mm]", "x"),
        ("time_ms", "u_x", "Encoder_X (um)", "x"),
        ("TIME [ms]", "VOLTAGE", "POSITION[MM]", "x"),
        ("Zeit (s)", "Spannung [mV]", "Weg in mm", "x"),
        ("__time", "/gantry/left/voltage", "/gantry/left/position", "gantry_left"),
        ("timestamp", "motorVoltage2", "encoderPos2", "axis2"),
        ("t", "u1", "y1", "axis1"),
        ("time", "left_u", "left_pos", "left"),
    ],
)
def test_headers_in_any_case_and_spelling(tmp_path: Path, time: str, voltage: str, position: str, axis: str) -> None:
    """Capitals, blanks, signs, units at the end, other languages; a note gives the interpretation."""
    text = f"{time} {voltage} {position}"
    milli = "ms" in text, "mV" in text
    units = {"mm": 1e3, "MM": 1e3, "um": 1e6}
    factor = next((factor for unit, factor in units.items() if unit in position), 1.0)
    path = csv_of(tmp_path, {time: T * (1e3 if milli[0] else 1.0), voltage: U * (1e3 if milli[1] else 1.0), position: Y * factor})
    recording = load(path)
    assert_the_axis(recording, axis)
    assert any(f"= {header(voltage)[0]!r}" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("name", "role", "axis", "unit"),
    [
        ("y_position", "output", "y", ""),
        ("u_y", "input", "y", ""),
        ("x_y", "output", "x", ""),
        ("pos_ref", "reference", "", ""),
        ("x position command", "reference", "x", ""),
        ("current_A", "input", "", "A"),
        ("voltage_a", "input", "a", ""),
        ("current_a", "input", "a", ""),
        ("speed_rpm", "output", "", "rpm"),
        ("speed RPM", "output", "", "rpm"),
        ("i_q [A]", "input", "", "A"),
        ("Axis1.SetTorque [%]", "input", "axis1", "%"),
        ("POS_FBK", "output", "", ""),
        ("phi (rad)", "output", "", "rad"),
        ("torque_nm", "input", "", "Nm"),
        ("effort_Nm", "input", "", "Nm"),
        ("joint1_effort", "input", "joint1", ""),
        ("Zeitstempel", "time", "", ""),
        ("Uhrzeit", "time", "", ""),
        ("Sollposition", "reference", "", ""),
        ("Drehzahlsollwert", "reference", "", ""),
        ("Istposition", "output", "", ""),
        ("Posición", "output", "", ""),
        ("Stellgröße", "input", "", ""),
        ("Torque [Nm] (filtered)", "input", "", "Nm"),
    ],
)
def test_what_a_name_says(name: str, role: str, axis: str, unit: str) -> None:
    """Role, axis and unit of ambiguous letters."""
    found = meaning(*header(name))
    assert found is not None and (found.role, found.axis, found.unit) == (role, axis, unit)


@pytest.mark.parametrize("name", ["position_error", "CH1", "temperature", "state", "supply voltage"])
def test_names_that_say_nothing(name: str) -> None:
    """They have no role."""
    assert meaning(*header(name)) is None


def test_columns_can_be_mapped_scaled_and_given_units(tmp_path: Path) -> None:
    """The issue's example: time, input and output by their names, counts with their length, and a rate."""
    path = csv_of(tmp_path, {"Zeit": T * 0, "Motor Voltage": U, "Pos": np.round(Y / 0.5e-9), "junk": U})
    said = pairs(['time=Zeit,x.input="Motor Voltage",x.output=Pos'], "--map")
    assert said == {"time": "Zeit", "x.input": "Motor Voltage", "x.output": "Pos"}
    recording = load(path, columns=said, units={"x.output": "counts"}, scales={"x.output": 0.5e-9}, rate=1000.0)
    assert recording.output_unit == "m" and recording.sampling_rate == 1000.0
    np.testing.assert_allclose(recording.position[:, 0], Y, atol=0.5e-9)
    assert any("counts times 5e-10 is in m" in note for note in recording.notes)
    assert any("'Zeit' is not used" in note for note in recording.notes)


def test_a_column_can_be_given_by_its_number_or_in_another_spelling(tmp_path: Path) -> None:
    """1 is the first; case and signs do not matter; an unknown name gives an error with the existing ones."""
    path = csv_of(tmp_path, {"A b": T, "ch 2": U, "ch 3": Y})
    assert_the_axis(load(path, columns={"time": "1", "input": "CH_2", "output": "#3"}))
    with pytest.raises(BadRecording, match="no column 'ch 4'; it has A b, ch 2, ch 3"):
        load(path, columns={"time": "1", "input": "ch 4", "output": "3"})


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"columns": {"x.volts": "a"}}, "--map is 'x.volts'"),
        ({"units": {"speed": "m/s"}}, "--unit is 'speed'"),
        ({"scales": {"output": 0.0}}, "a number that is not 0"),
        ({"rate": -5.0}, "rate is -5.0"),
        ({"rate": float("nan")}, "rate is nan"),
    ],
)
def test_wrong_options_of_reading_are_one_line(tmp_path: Path, options: dict[str, Any], says: str) -> None:
    """The given value, and the allowed ones."""
    with pytest.raises(BadInput) as caught:
        load(csv_of(tmp_path, {"time": T, "u": U, "y": Y}), **options)
    assert says in str(caught.value)


def test_a_table_without_time_needs_a_rate(tmp_path: Path) -> None:
    """The error says so, and with a rate the file is read; a first row of numbers is no header."""
    path = csv_of(tmp_path, {"u": U, "y": Y})
    with pytest.raises(BadRecording, match=r"no time column.*--rate in Hz"):
        load(path)
    assert_the_axis(load(path, rate=1000.0))
    path.write_text(path.read_text().partition("\n")[2])
    found = load(path, rate=1000.0, columns={"input": "1", "output": "2"})
    assert_the_axis(found)
    assert any("first row holds numbers" in note for note in found.notes)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("fs", RATE), ("Fs", RATE), ("f_s", RATE), ("rate", RATE), ("Sampling_Rate_Hz", RATE), ("SAMPLING FREQUENCY", RATE)),
        *(("Ts", 1.0 / RATE), ("T_s", 1.0 / RATE), ("dt_s", 1.0 / RATE), ("sampleTime", 1.0 / RATE)),
    ],
)
@pytest.mark.parametrize(("voltage", "position"), [("u", "y"), ("motor_voltage", "encoder_position_m")])
def test_arrays_may_say_their_rate_or_period_in_any_spelling(tmp_path: Path, name: str, value: float, voltage: str, position: str) -> None:
    arrays: dict[str, Any] = {voltage: U, position: Y, name: value}
    np.savez(tmp_path / "a.npz", **arrays)
    assert load(tmp_path / "a.npz").sampling_rate == pytest.approx(RATE, rel=1e-12)


def test_a_period_in_another_unit_is_not_taken_for_seconds(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", u=U, y=Y, dt_ms=np.array(1e3 / RATE))
    with pytest.raises(BadRecording, match="neither a time column nor a usable fs"):
        load(tmp_path / "a.npz")


def test_a_row_for_each_joint(tmp_path: Path) -> None:
    """Long format: a column names the joint of each row; each becomes an axis, in any order of rows."""
    names = ["shoulder", "elbow_2"]
    rows = [(t, name, u * (1 + k), y * (1 + k)) for t, u, y in zip(T, U, Y, strict=True) for k, name in enumerate(names)]
    columns: dict[str, FloatArray | Sequence[str]] = {
        "time": np.array([row[0] for row in rows]),
        "joint": [row[1] for row in rows],
        "Current (A)": np.array([row[2] for row in rows]),
        "angle": np.array([row[3] for row in rows]),
    }
    recording = load(csv_of(tmp_path, columns))
    assert (recording.axes, recording.input_unit, recording.output_unit, len(recording)) == (("shoulder", "elbow_2"), "A", "rad", len(T))
    np.testing.assert_allclose(recording.position[:, 1], 2 * Y)
    assert load(tmp_path / "data.csv", axes=["elbow_2"]).axes == ("elbow_2",)


@pytest.mark.parametrize(("force", "way"), [("F [N]", "x [m]"), ("F", "x"), ("I_motor [A]", "slide [m]"), ("u", "x")])
def test_units_and_symbols_of_physics_tell_a_role_where_no_name_does(tmp_path: Path, force: str, way: str) -> None:
    """F and x, or any name with the unit of a drive, or of a motion."""
    assert_the_axis(load(csv_of(tmp_path, {"t": T, force: U, way: Y, "supply [V]": U * 0.0 + 24.0})))


def test_two_that_a_unit_alone_would_take_are_asked_about(tmp_path: Path) -> None:
    """Both have a unit of drives, and no known name."""
    with pytest.raises(BadRecording, match=r"'one' and 'two' may both be the input. Choose one with --map input='one'"):
        load(csv_of(tmp_path, {"t": T, "one [A]": U, "two [A]": U, "position": Y}))


def echoed(path: Path, joints: Sequence[str], groups: Sequence[Sequence[FloatArray]]) -> Path:
    """Joint states by ros2 topic echo --csv: all fields in sequence, an empty cell for an empty array."""
    rows = []
    for k, at in enumerate(T):
        stamp = 1_700_000_000_987_654_321 + round(at * 1e9)
        fields = [[stamp // 10**9, stamp % 10**9, ""], joints, *([repr(float(one[k])) for one in group] or [""] for group in groups)]
        rows.append(",".join(str(cell) for field in fields for cell in field))
    file = path / "echo.csv"
    file.write_text("\n".join(rows) + "\n", "utf-8")
    return file


def test_what_topic_echo_prints_of_joint_states_needs_no_names(tmp_path: Path) -> None:
    """Two joints with all fields; one without velocities, whose empty array is an empty cell; the time is that of the stamps."""
    both = load(echoed(tmp_path, ("left", "right"), [(Y, 2.0 * Y), (U, U), (U, 3.0 * U)]))
    assert both.axes == ("left", "right") and both.sampling_rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_allclose(both.voltage, np.column_stack((U, 3.0 * U)))
    np.testing.assert_allclose(both.position, np.column_stack((Y, 2.0 * Y)), atol=1e-15)
    one = load(echoed(tmp_path, ("slider",), [(Y,), (), (U,)]))
    assert one.axes == ("slider",) and one.measured == "position"
    np.testing.assert_allclose(one.voltage[:, 0], U)
    speeds = load(echoed(tmp_path, ("slider",), [(), (Y,), (U,)]))
    assert speeds.measured == "velocity"
    with pytest.raises(BadRecording, match="slider_position"):
        load(echoed(tmp_path, ("slider",), [(Y,), (), ()]))  # no input


def in_own_rows(folder: Path, columns: dict[str, tuple[np.ndarray, np.ndarray]]) -> Path:
    """A CSV with a row for each time of each column, as by PlotJuggler and joined tables. columns: times and values."""
    time = np.concatenate([instants for instants, _ in columns.values()])
    order, begin, table = np.argsort(time, kind="stable"), 0, {}
    for name, (instants, values) in columns.items():
        rows = np.full(len(time), np.nan)
        rows[begin : begin + len(instants)] = values
        table[name] = rows[order]
        begin += len(instants)
    return csv_of(folder, {"__time": time[order], **table})


def test_rows_of_their_own_for_input_and_output(tmp_path: Path) -> None:
    """PlotJuggler writes a row for each stamp of each topic: the input is held until its next value."""
    recording = load(in_own_rows(tmp_path, {"/x/voltage": (T, U), "/x/position": (T + 0.0003, Y)}))
    assert recording.sampling_rate == RATE and len(recording) == len(T) - 1 and len(recording.runs()) == 1  # unknown at the end
    np.testing.assert_array_equal(recording.voltage[:, 0], U[:-1])
    np.testing.assert_array_equal(recording.position[:, 0], Y[:-1])
    assert any("separate times" in note for note in recording.notes)


def test_two_axes_may_have_rows_of_their_own(tmp_path: Path) -> None:
    """Four topics with four stamps: the second position is interpolated to the times of the first."""
    columns = {
        "/x/voltage": (T, U),
        "/y/voltage": (T + 0.0001, 2 * U),
        "/x/position": (T + 0.0002, np.sin(T)),
        "/y/position": (T + 0.0003, np.cos(T)),
    }
    recording = load(in_own_rows(tmp_path, columns))
    assert recording.axes == ("x", "y") and len(recording) >= len(T) - 2
    time = recording.time
    np.testing.assert_allclose(recording.position, np.column_stack((np.sin(time - 0.0002), np.cos(time - 0.0003))), atol=1e-6)
    np.testing.assert_array_equal(recording.voltage[:, 1], 2 * recording.voltage[:, 0])


def test_of_a_faster_input_the_mean_is_taken_and_of_a_sparse_one_the_latest(tmp_path: Path) -> None:
    """Four commands between two positions move the axis by their mean; a command that is written only when it changes holds until then."""
    fine = np.arange(4 * len(T)) / (4 * RATE)
    values = np.random.default_rng(1).normal(size=len(fine))
    recording = load(in_own_rows(tmp_path, {"/x/voltage": (fine, values), "/x/position": (T + 1e-5, Y)}))
    np.testing.assert_allclose(recording.voltage[:-1, 0], values.reshape(-1, 4).mean(axis=1)[: len(recording) - 1], atol=1e-12)
    sparse = np.where(np.arange(len(T)) % 3 == 0, U, np.nan)
    held = load(csv_of(tmp_path, {"time": T, "x_voltage": sparse, "x_position": Y}))
    last = (len(T) - 1) // 3 * 3
    assert held.sampling_rate == RATE and len(held) == last + 1
    np.testing.assert_array_equal(held.voltage[:, 0], np.repeat(U[::3], 3)[: last + 1])


def test_words_in_other_columns_do_not_matter(tmp_path: Path) -> None:
    """A column of states is skipped, and so is a bad cell in an unused column."""
    path = csv_of(tmp_path, {"time": T, "state": ["RUN"] * len(T), "x_voltage": U, "x_position": Y, "note": ["1", *["oops"] * (len(T) - 1)]})
    assert_the_axis(load(path))


def test_titles_and_a_row_of_units(tmp_path: Path) -> None:
    """Lines of one cell above the names are left out, with a note; units may have their own row; a decimal comma is no separator."""
    path = csv_of(tmp_path, {"Time": T, "Voltage": U, "Pos": 1e3 * Y})
    table = path.read_text()
    names, _, rest = table.partition("\n")
    path.write_text(f"Test bench 7\n{names}\ns,V,mm\n{rest}")
    recording = load(path)
    assert_the_axis(recording)
    assert any("'Test bench 7'" in note for note in recording.notes)
    path.write_text(f"Zeit;Spannung [V];Weg [mm]\n{rest.replace(',', ';').replace('.', ',')}")
    assert_the_axis(load(path))


def test_columns_whose_names_are_there_twice_are_chosen_by_number(tmp_path: Path) -> None:
    """The error says so."""
    path = csv_of(tmp_path, {"time": T, "u": U, "y": Y, "u2": 0.0 * U, "y2": 0.0 * Y})
    path.write_text(path.read_text().replace("u2,y2", "u,y"))
    with pytest.raises(BadRecording, match=r"'u' is there twice.*choose columns by number with --map"):
        load(path)
    assert_the_axis(load(path, columns={"input": "2", "output": "3"}))
    assert_the_axis(load(path, columns={"time": "1", "x.input": "2", "x.output": "3"}))


def test_of_several_times_one_is_taken_and_none_is_an_axis(tmp_path: Path) -> None:
    """A note says which; the times of voltage and position are no voltage and position of an axis called time."""
    recording = load(csv_of(tmp_path, {"Time": T, "Timestamp": 2.0 * T, "u": U, "y": Y}))
    assert_the_axis(recording)
    assert any("'Time' is taken as the time, not 'Timestamp'; choose with --map" in note for note in recording.notes)
    own = {"t": T, "time_voltage": T, "time_position": T, "x_voltage": U, "x_position": Y}
    assert load(csv_of(tmp_path, own)).axes == ("x",)


def test_what_may_be_either_is_asked(tmp_path: Path) -> None:
    """Two columns for one role: the error names both, and the option; of voltage and current the voltage is used, with a note."""
    path = csv_of(tmp_path, {"time": T, "torque left motor": U, "torque motor left": U, "left position": Y})
    with pytest.raises(BadRecording, match=r"'torque left motor' and 'torque motor left' may both be the input\. Choose one with --map left.input="):
        load(path)
    path = csv_of(tmp_path, {"Time": T, "Motor Current": Y, "Motor Voltage": U, "Pos": Y, "Vel": U})
    recording = load(path)
    assert_the_axis(recording)
    assert any("'Motor Voltage' is taken as the input, not 'Motor Current'" in note for note in recording.notes)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_clocks_since_1970_are_understood(tmp_path: Path, unit: str) -> None:
    """A stamp of 1.8e12 is in ms, with a note; dates are times, too."""
    factor = {"ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
    recording = load(csv_of(tmp_path, {"stamp": np.round((T + 1.8e9) * factor), "u": U, "y": Y}))
    assert recording.sampling_rate == pytest.approx(RATE, rel=1e-3) and len(recording) == len(T)
    assert any(f"taken as {unit} since 1970" in note for note in recording.notes)
    dates = [f"2026-03-01T12:00:{t:06.3f}" for t in T]
    assert load(csv_of(tmp_path, {"time": dates, "u": U, "y": Y})).sampling_rate == pytest.approx(RATE)


@pytest.mark.parametrize(
    ("given", "name", "scale", "quantity", "guessed"),
    [
        ("mm", "m", 1e-3, "position", False),
        ("MM", "m", 1e-3, "position", True),
        ("ft", "m", 0.3048, "position", False),
        ("counts", "counts", 1.0, "position", False),
        ("rpm", "rad/s", 2 * np.pi / 60, "velocity", False),
        *((spelling, "rad/s", 2 * np.pi / 60, "velocity", False) for spelling in ("r/min", "U/min", "1/min", "min-1", "min^-1", "min⁻¹", "rev/min")),
        ("krpm", "rad/s", 2000 * np.pi / 60, "velocity", False),
        *((spelling, "rad/s", np.pi / 180, "velocity", False) for spelling in ("dps", "deg/s", "°/sec", "deg s^-1", "deg·s⁻¹")),
        ("mm s⁻²", "m/s^2", 1e-3, "acceleration", False),
        ("Nmm", "N m", 1e-3, "torque", False),
        ("N-m", "N m", 1.0, "torque", False),
        ("Arms", "A", 1.0, "current", False),
        ("‰", "FS", 1e-3, "command", False),
        ("mm/s", "m/s", 1e-3, "velocity", False),
        ("m/s²", "m/s^2", 1.0, "acceleration", False),
        ("N·m", "N m", 1.0, "torque", False),
        ("nm", "m", 1e-9, "position", False),
        ("NM", "NM", 1.0, "unknown", False),
        ("%", "FS", 0.01, "command", False),
        ("min", "s", 60.0, "time", False),
        ("furlong", "furlong", 1.0, "unknown", False),
    ],
)
def test_units(given: str, name: str, scale: float, quantity: str, guessed: bool) -> None:
    """Known, guessed from another spelling, or kept as text; an ambiguous unit (NM) is not guessed."""
    found = unit_of(given)
    assert (found.name, found.quantity, found.guessed) == (name, quantity, guessed) and found.scale == pytest.approx(scale)


def test_units_that_are_guessed_or_unknown_are_said(tmp_path: Path) -> None:
    """MM is mm, with a note; counts are no length; furlongs are kept as text."""
    for unit, says in (
        ("MM", "'MM' of the output is taken as mm"),
        ("counts", "counts, which is not a length"),
        ("furlong", "'furlong' of the output is not known"),
    ):
        assert any(says in note for note in load(csv_of(tmp_path, {"time": T, "u": U, f"y[{unit}]": Y})).notes)
    assert load(csv_of(tmp_path, {"time[min]": T / 60, "u": U, "y": Y})).sampling_rate == pytest.approx(RATE)
    with pytest.raises(BadRecording, match="'V' of the time is not a unit of time"):
        load(csv_of(tmp_path, {"time[V]": T, "u": U, "y": Y}))


def test_a_velocity_in_a_unit_that_is_not_known_is_no_position(tmp_path: Path) -> None:
    """The name means a velocity: one line names the option, with which the file is read."""
    path = csv_of(tmp_path, {"time": T, "u": U, "speed [knots]": Y})
    with pytest.raises(BadRecording, match=r"the unit 'knots' of the velocity 'speed' is not known\. .* --unit output=rpm"):
        load(path)
    assert load(path, units={"output": "rpm"}).measured == "velocity"


@pytest.mark.parametrize("kind", ["npz", "mat"])
def test_arrays_take_the_same_names_and_options(tmp_path: Path, kind: str) -> None:
    """NPZ and MAT: names in any spelling, --map, a matrix with columns, units and scale."""
    path = tmp_path / f"a.{kind}"

    def written(**content: Any) -> Path:
        np.savez(path, **content) if kind == "npz" else scipy.io.savemat(path, content)
        return path

    assert_the_axis(load(written(Time=T, Motor_Voltage=U, Encoder_mm=1e3 * Y)))
    matrix = np.column_stack((T, 0 * T, Y / 1e-6, U))
    recording = load(written(data=matrix, n=3.0), columns={"time": "data:1", "input": "data:4", "output": "data:3"}, scales={"output": 1e-6})
    assert_the_axis(recording)
    with pytest.raises(BadRecording) as caught:
        load(written(data=matrix))
    assert "--map" in str(caught.value) and "data:4" in str(caught.value) and "key" not in str(caught.value)


def test_structs_of_control_desk_simulink_and_iddata(tmp_path: Path) -> None:
    """X and Y(n).Data with names, signals(n).values with labels, InputData and OutputData with Ts; also in nested structs."""
    path = tmp_path / "a.mat"
    block = {"Name": '"Model Root"/"{}"/"In1"', "Unit": ""}
    y = [{**block, "Name": block["Name"].format(name), "Data": values} for name, values in (("Motor positie", Y), ("motor input", U))]
    scipy.io.savemat(path, {"meas": {"X": {"Name": "", "Data": T}, "Y": y, "Capture": {"SamplingPeriod": 1e-3}}})
    assert_the_axis(load(path))
    assert_the_axis(load(path, columns={"output": "Motor positie", "input": "motor input"}))
    signals = [{"label": name, "values": values} for name, values in (("voltage", U), ("position", Y))]
    scipy.io.savemat(path, {"out": {"time": T, "signals": signals}})
    assert_the_axis(load(path))
    scipy.io.savemat(
        path, {"z": {"OutputData": Y, "InputData": U, "Ts": 1e-3, "InputUnit": np.array(["V"], object), "OutputUnit": "m", "InterSample": "foh"}}
    )
    recording = load(path)
    assert_the_axis(recording)
    assert any("foh" in note for note in recording.notes)
    scipy.io.savemat(path, {"lab": {"run": {"first": {"t": T, "u": U, "y": Y}}, "date": "today"}})
    assert_the_axis(load(path))


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [
        ("commanded_deg_s", "deg/s", np.pi / 180),
        ("joint_velocity_rad_s", "rad/s", 1.0),
        ("feedback_mm_s", "mm/s", 1e-3),
        ("acc_mm_s2", "mm/s^2", 1e-3),
        ("feedback_deg", "deg", np.pi / 180),
    ],
)
def test_a_unit_at_the_end_of_a_mapped_name_is_read(tmp_path: Path, name: str, unit: str, scale: float) -> None:
    """Units as written by programs, without brackets and slashes; the note gives the conversion."""
    t = np.arange(400) / 1e3
    y = np.cumsum(np.cumsum(np.random.default_rng(1).normal(size=400)))
    path = tmp_path / "a.csv"
    np.savetxt(path, np.column_stack((t, np.sin(50 * t), y)), "%.9g", ",", header=f"time,u,{name}", comments="")
    found = load(path, columns={"output": name})
    told = [note for note in found.notes if "converted from" in note]
    assert scale == 1.0 or any(f"from {unit} to" in note for note in told), found.notes
    assert found.measured == {"deg": "position"}.get(unit, "acceleration" if "^2" in unit else "velocity")


def test_a_time_in_s_is_no_speed() -> None:
    """inch per second is written another way."""
    found = meaning("time_in_s", "")
    assert found is not None and found.role == "time"
