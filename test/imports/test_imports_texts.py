"""Text files of instruments and programs: header lines, separators, and formats of time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.table_making import RATE, T, U, Y

from xy_sysid.errors import BadRecording
from xy_sysid.imports import load
from xy_sysid.samples.recording import Recording

TEKTRONIX = "Model,MSO54\nWaveform Type,ANALOG\nHorizontal Units,s\nSample Interval,1e-3\n\n"
LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\t\n\nChannels\t2\t\nSamples\t4\t4\n"
    "Y_Unit_Label\tVolts\tVolts\nX0\t0.0\t0.0\nDelta_X\t0.001\t0.001\n***End_of_Header***\t\t\n"
)


def written(path: Path, above: str, separator: str = ",", time: Callable[[float], object] = repr, ending: str = "log.csv") -> Path:
    """A file with T, U and Y below header lines."""
    rows = (separator.join((str(time(float(t))), repr(float(u)), repr(float(y)))) for t, u, y in zip(T, U, Y, strict=True))
    file = path / ending
    file.write_text(above + "\n".join(rows) + "\n", "utf-8")
    return file


def assert_read(recording: Recording) -> None:
    """Assert that the recording has the written data."""
    assert recording.axes == ("x",) and recording.sampling_rate == pytest.approx(RATE, rel=1e-6)
    np.testing.assert_allclose(recording.voltage[:, 0], U, rtol=1e-12)
    np.testing.assert_allclose(recording.position[:, 0], Y, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("above", "separator", "ending"),
    [
        ("time voltage position\n", " ", "log.txt"),
        ("  Time (s)   Motor Voltage (V)   Encoder position (m)\n", "   ", "log.dat"),
        ("time,voltage,position\n[s],[V],[m]\n", ",", "log.csv"),
        (TEKTRONIX + "TIME,VOLTAGE,POSITION\n", ",", "log.csv"),
        (TEKTRONIX + "time,voltage,position\ns,V,m\n", ",", "log.csv"),
        (LABVIEW + "time\tVoltage\tPosition\tComment\n", "\t", "log.lvm"),
        ("A title, with a comma\nand a remark\ntime;voltage;position\n", ";", "log.csv"),
    ],
)
def test_a_table_is_found_below_what_stands_above_it(tmp_path: Path, above: str, separator: str, ending: str) -> None:
    """Blanks between cells, units in brackets, headers of oscilloscopes and LabVIEW; a note names omitted lines."""
    recording = load(written(tmp_path, above, separator, ending=ending))
    assert_read(recording)
    assert any("are no columns" in note for note in recording.notes) == (above.count("\n") > 2)


def test_a_row_of_units_may_hold_one_that_is_not_known(tmp_path: Path) -> None:
    """It is the row below the names."""
    recording = load(written(tmp_path, "time;voltage;position\ns;V;furlong\n", ";"))
    assert_read(recording)
    assert recording.output_unit == "furlong"


@pytest.mark.parametrize("sign", ["#", "%", "//"])
def test_remarks_in_a_table_are_left_out(tmp_path: Path, sign: str) -> None:
    """With any comment sign; one above the table may contain the names. A row of units that begins with % is not a remark."""
    assert_read(load(written(tmp_path, f"{sign} made by hand, on bench 7\n{sign} time voltage position\n", " ")))
    file = written(tmp_path, "time,voltage,position\n")
    file.write_text(file.read_text("utf-8").replace("\n0.002,", f"\n{sign} the door was opened here\n0.002,"), "utf-8")
    assert_read(load(file))
    columns = load(written(tmp_path, "torque,time,angle\n%,s,rad\n"), columns={"input": "torque", "output": "angle"}, rate=RATE)
    assert columns.input_unit == "FS"


@pytest.mark.parametrize("below", ["Mean;3;2\nStd;0.1;0.2\n", "End of file", "***End***\n"])
def test_rows_below_the_table_that_are_no_data_are_left_out(tmp_path: Path, below: str) -> None:
    """A note says which; a word inside a row of data is still an error."""
    file = written(tmp_path, "time;voltage;position\n", ";")
    table = file.read_text("utf-8")
    file.write_text(table + below, "utf-8")
    recording = load(file)
    assert_read(recording)
    assert any(f"are no data ({below.splitlines()[0]!r}); they are left out" in note for note in recording.notes)
    file.write_text(table + f"3.5;broken;2\n{below}", "utf-8")
    with pytest.raises(BadRecording, match="'broken' is not a number"):
        load(file)


def test_what_numpy_writes_is_read(tmp_path: Path) -> None:
    """savetxt: blanks, and names in a remark or none."""
    table = np.column_stack((T, U, Y))
    np.savetxt(tmp_path / "named.txt", table, header="t u y")
    np.savetxt(tmp_path / "plain.txt", table)
    assert_read(load(tmp_path / "named.txt"))
    assert_read(load(tmp_path / "plain.txt", columns={"time": "1", "input": "2", "output": "3"}))


@pytest.mark.parametrize(
    "time",
    [
        lambda t: f"{t:.3f} sec",
        lambda t: f"{1e3 * t:.1f}ms",
        lambda t: f"10:{int(t // 60) + 7:02d}:{t % 60:06.3f}",
        lambda t: f"{int(t // 60)}:{t % 60:06.3f}",
        lambda t: f"10:00:{int(t):02d}:{round(1e3 * t) % 1000:03d}",
        lambda t: f"10:00:{int(t):02d}:{round(1e3 * t) % 1000}",
        lambda t: f"23.11.2026 10:00:{t:06.3f}",
        lambda t: f"11/23/2026 1:00:{t:06.3f} PM",
        lambda t: f"{'24' if t >= 0.1 else '23'}.11.2026 {'00:00' if t >= 0.1 else '23:59'}:{(t + 59.9) % 60:06.3f}",
        lambda t: f"{'12' if t >= 0.1 else '11'}:{'00' if t >= 0.1 else '59'}:{(t + 59.9) % 60:06.3f} {'AM' if t >= 0.1 else 'PM'}",
    ],
    ids=[
        "seconds",
        "milliseconds",
        "clock",
        "minutes",
        "colon before ms",
        "ms without zeros",
        "date",
        "afternoon",
        "midnight by date",
        "midnight by clock",
    ],
)
def test_times_in_words_are_understood(tmp_path: Path, time: Callable[[float], object]) -> None:
    """With a unit, as time of day, after a date in any format, past midnight."""
    assert_read(load(written(tmp_path, "Time,voltage,position\n", time=time)))


def test_a_clock_outside_of_this_century_counts_no_time_since_1970(tmp_path: Path) -> None:
    """The year 2127 in us is implausible; such numbers are seconds without other information."""
    far = load(written(tmp_path, "time,voltage,position\n", time=lambda t: f"{5e15 + round(1e6 * t):.0f}"))
    assert far.sampling_rate == pytest.approx(1e-6 * RATE) and not any("since 1970" in note for note in far.notes)


def test_words_that_are_no_time_are_named(tmp_path: Path) -> None:
    """The error gives the first of them, and the allowed form."""
    with pytest.raises(BadRecording, match=r"the time 'Time' is 'soon' in sample 4\. Give seconds, times like 12:00:00\.001, or dates"):
        load(written(tmp_path, "Time,voltage,position\n", time=lambda t: "soon" if round(1000 * t) == 3 else f"{t} s"))


def test_a_bad_cell_near_the_beginning_is_no_title(tmp_path: Path) -> None:
    """Rows above it are data: they are not left out, and the error names the cell."""
    file = written(tmp_path, "time,voltage,position\n")
    lines = file.read_text("utf-8").splitlines()
    lines[3] = lines[3].replace(lines[3].split(",")[1], "broken")
    file.write_text("\n".join(lines) + "\n", "utf-8")
    with pytest.raises(BadRecording, match="row 4, column 'voltage': 'broken' is not a number"):
        load(file)


def test_a_column_without_a_telling_name_that_rises_as_a_clock_does_is_the_time(tmp_path: Path) -> None:
    """LabVIEW's X_Value, with a note. A counter of rows is no time, and two clocks are ambiguous."""
    recording = load(written(tmp_path, "X_Value,voltage,position\n"))
    assert_read(recording)
    assert any(note.startswith("'X_Value' rises by 0.001 from row to row: it is used as the time, in s") for note in recording.notes)
    with pytest.raises(BadRecording, match="no time column"):
        load(written(tmp_path, "row,voltage,position\n", time=lambda t: round(t * RATE)))
    table = np.column_stack((T, 2.0 * T, U, Y))
    np.savetxt(tmp_path / "two.csv", table, delimiter=",", header="one,other,voltage,position", comments="")
    with pytest.raises(BadRecording, match="no time column"):
        load(tmp_path / "two.csv")
