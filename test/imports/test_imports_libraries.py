"""File formats of external libraries, written here by the same library if it can write."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import refused
from helpers.table_making import RATE, T, U, Y

from xy_sysid.errors import MissingExtra, XySysidError
from xy_sysid.imports import load
from xy_sysid.imports.registry import FORMATS, Format

FAST = np.repeat(U, 2)  # the input, at twice the rate of the output


def as_mat73(path: Path) -> Path:
    """In MATLAB's layout: transposed arrays, text as numbers, a struct as a group, an array of structs as references."""
    h5py = pytest.importorskip("h5py")

    def stored(group: Any, name: str, values: Any) -> Any:
        text = isinstance(values, str)
        numbers = np.array([[ord(sign)] for sign in values], np.uint16) if isinstance(values, str) else np.atleast_2d(np.asarray(values)).T
        made = group.create_dataset(name, data=numbers)
        made.attrs["MATLAB_class"] = np.bytes_("char" if text else "double")
        return made

    with h5py.File(path / "a.mat", "w", userblock_size=512) as file:
        hidden, run = file.create_group("#refs#"), file.create_group("run")
        run.attrs["MATLAB_class"] = np.bytes_("struct")
        x, y = run.create_group("X"), run.create_group("Y")
        stored(x, "Data", T)
        for field, both in (("Name", ("Model Root/u_motor", "Model Root/angle")), ("Unit", ("V", "deg")), ("Data", (U, np.rad2deg(Y)))):
            parts = [stored(hidden, f"{field}{number}", one) for number, one in enumerate(both)]
            y.create_dataset(field, data=np.array([[part.ref] for part in parts], dtype=h5py.ref_dtype))
    whole = (path / "a.mat").read_bytes()
    (path / "a.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<HH", 0x0200, 0x4D49) + whole[128:])
    return path / "a.mat"


def as_mf4(path: Path) -> Path:
    """Two groups with separate times."""
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(samples=FAST, timestamps=np.arange(2 * len(T)) / (2 * RATE), name="motor_voltage", unit="V")])
        file.append([asammdf.Signal(samples=np.rad2deg(Y), timestamps=T, name="angle", unit="deg")])
        file.save(path / "a.mf4")
    return path / "a.mf4"


def as_tdms(path: Path) -> Path:
    """Waveforms of two rates, with their increments; the faster one starts before the other."""
    nptdms = pytest.importorskip("nptdms")
    begin = np.datetime64("2026-03-03T10:00:00", "us")

    def channel(name: str, values: object, step: float, unit: str, later: int = 0) -> object:
        told = {"wf_increment": step, "wf_start_offset": 0.0, "wf_start_time": begin + np.timedelta64(later, "us"), "unit_string": unit}
        return nptdms.ChannelObject("run", name, values, properties=told)

    with nptdms.TdmsWriter(path / "a.tdms") as file:
        early = np.concatenate((np.zeros(10), FAST))
        later = round(1e6 * 5 / RATE)
        file.write_segment([channel("motor_voltage", early, 0.5 / RATE, "V"), channel("angle", np.rad2deg(Y), 1 / RATE, "deg", later)])
    return path / "a.tdms"


def as_ulog(path: Path) -> Path:
    """Two topics. pyulog only writes files that it has read, so the first file is built here by the specification, and pyulog rewrites it."""
    pyulog = pytest.importorskip("pyulog")

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    content = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message("B", bytes(40))
    for number, (topic, field, values, times) in enumerate(
        (("motor", "voltage", FAST, np.arange(2 * len(T)) / (2 * RATE)), ("joint", "angle", Y, T))
    ):
        content += message("F", f"{topic}:uint64_t timestamp;double {field};".encode())
        samples = b"".join(
            message("D", struct.pack("<HQd", number, round(1e6 * at), one)) for at, one in zip(times.tolist(), values.tolist(), strict=True)
        )
        content += message("A", struct.pack("<BH", 0, number) + topic.encode()) + samples if number else b""
        later = samples
        if number == 0:
            first = message("A", struct.pack("<BH", 0, 0) + topic.encode()) + later
    head, tail = content[: 16 + 43], content[16 + 43 :]
    formats = b"".join(
        message("F", f"{topic}:uint64_t timestamp;double {field};".encode()) for topic, field in (("motor", "voltage"), ("joint", "angle"))
    )
    begin = tail.index(message("A", struct.pack("<BH", 0, 1) + b"joint"))
    (path / "made.ulg").write_bytes(head + formats + first + tail[begin:])
    pyulog.ULog(str(path / "made.ulg")).write_ulog(str(path / "a.ulg"))
    return path / "a.ulg"


def as_wpilog(path: Path) -> Path:
    """Two entries with separate stamps."""
    wpiutil, log = pytest.importorskip("wpiutil"), pytest.importorskip("wpiutil.log")
    writer = wpiutil.DataLogWriter(str(path / "a.wpilog"))
    voltage, angle = log.DoubleLogEntry(writer, "NT:/motor/voltage"), log.DoubleLogEntry(writer, "NT:/joint/angle")
    for at, one in enumerate(FAST.tolist()):
        voltage.append(one, 1_000_000 + round(1e6 * at / (2 * RATE)))
    for at, one in zip(T.tolist(), Y.tolist(), strict=True):
        angle.append(one, 1_000_000 + round(1e6 * at))
    writer.flush()
    writer.stop()
    return path / "a.wpilog"


def as_parquet(path: Path) -> Path:
    """Two episodes as LeRobot stores them: lists in each row, and a time that begins anew."""
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    half = len(T) // 2
    times = np.concatenate((T[:half], T[half:] - T[half]))
    columns = {"action": [[u, 0.0] for u in U.tolist()], "observation.state": [[y, 0.0] for y in Y.tolist()], "timestamp": times}
    parquet.write_table(pyarrow.table(columns), path / "a.parquet")
    return path / "a.parquet"


@pytest.mark.parametrize(
    ("make", "options"),
    [
        (as_mat73, {}),
        (as_mf4, {}),
        (as_tdms, {}),
        (as_ulog, {"units": {"output": "rad"}}),
        (as_wpilog, {"units": {"output": "rad"}}),
        (as_parquet, {"columns": {"input": "action[0]", "output": "observation.state[0]"}, "units": {"input": "V", "output": "rad"}}),
    ],
)
def test_what_a_library_wrote_is_read(tmp_path: Path, make: Callable[[Path], Path], options: dict[str, Any]) -> None:
    """Input, output, units and times are recovered; channels of other rates are held to the output's clock, with a note."""
    found = load(make(tmp_path), **options)
    assert found.sampling_rate == pytest.approx(RATE, rel=1e-6) and (found.input_unit, found.output_unit) == ("V", "rad")
    assert np.allclose(found.position[:, 0], Y[: len(found)], atol=1e-9) and np.allclose(found.voltage[:, 0], U[: len(found)])
    assert len(found) == len(T) and len(found.runs()) == (2 if make is as_parquet else 1)
    if make in (as_mf4, as_tdms, as_ulog, as_wpilog):
        assert any("have separate times: they are sampled at those of" in note for note in found.notes)


@pytest.mark.parametrize("form", [form for form in FORMATS if form.extra], ids=lambda form: form.extra)
def test_a_library_that_is_missing_is_one_line_that_names_the_extra(tmp_path: Path, form: Format, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the extra to install, which exists in setup.py; damaged files also give one line."""
    ending, extra = form.endings[0], form.extra
    path = tmp_path / f"a{ending}"
    path.write_bytes(b"MATLAB 7.3 MAT-file" if extra == "mat73" else b"no such thing")
    with pytest.raises(XySysidError):
        load(path)
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    for name in ("h5py", "asammdf", "nptdms", "pyulog", "wpiutil", "pyarrow"):
        (blocked / f"{name}.py").write_text(f"raise ModuleNotFoundError('no', name={name!r})")
    monkeypatch.setenv("PYTHONPATH", str(blocked))
    with pytest.raises(MissingExtra) as caught:
        load(path)
    assert f"pip install 'xy_sysid[{extra}]'" in str(caught.value) and "\n" not in str(caught.value)
    assert f'"{extra}":' in (Path(__file__).parents[2] / "setup.py").read_text("utf-8")
    assert "is not installed" in refused("frf", path)


def test_the_page_names_every_format() -> None:
    """Each ending and each extra of the registry is in the table of docs/files.md."""
    page = (Path(__file__).parents[2] / "docs" / "files.md").read_text("utf-8")
    table = page.partition("## Which files work")[2].partition("**Two files.**")[0].lower()
    for form in FORMATS:
        assert form.extra in table and form.kind in table, form.kind
