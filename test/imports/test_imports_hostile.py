"""Malicious and partly damaged files: one clear line at once, or the rest is read with notes."""

from __future__ import annotations

import contextlib
import os
import resource
import sqlite3
import struct
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from backports import zstd
from helpers.bag_making import RATE, STORE, a_bag, assert_true_numbers, both, in_chunks, joint_state, numbered, rosbags_writer, the_file
from helpers.busy import allowed
from helpers.table_making import T, U, Y, csv_of

from xy_sysid.bags.cdr import ARRAY_TYPE, JOINT_TYPE, encode_array
from xy_sysid.errors import BadRecording, XySysidError
from xy_sysid.imports import load
from xy_sysid.samples.block import Block, pack

QUICK = 2.0  # s, limit for an error


def error_of(path: Path, **options: Any) -> str:
    with pytest.raises(BadRecording) as caught:
        load(path, **options)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 800
    return str(caught.value)


@contextlib.contextmanager
def within(seconds: float) -> Iterator[None]:
    """Fails if the body takes longer."""
    begun = time.monotonic()
    yield
    assert time.monotonic() - begun < allowed(seconds)


@pytest.fixture
def small_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Context in which at most 40 MB may be loaded."""
    whole = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    monkeypatch.setattr("xy_sysid.imports.limits.SHARE", 4 * 40e6 / whole)


@pytest.mark.usefixtures("small_memory")
def test_arrays_that_swell_are_refused_before_they_are_unpacked(tmp_path: Path) -> None:
    """npz and mat of a few kB that decompress to 400 MB, declared or hidden: refused, without growth of this process's memory."""
    big = np.zeros(50_000_000)
    np.savez_compressed(tmp_path / "a.npz", t=T, u=U, y=Y, other=big)
    scipy.io.savemat(tmp_path / "a.mat", {"t": T, "u": U, "y": Y, "other": big}, do_compression=True)
    del big
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for name in ("a.npz", "a.mat"):
        assert (tmp_path / name).stat().st_size < 1e6
        with within(QUICK + 3):  # the reader of .mat is a separate process
            assert "0.4 GB, and 0.04 GB may be loaded" in error_of(tmp_path / name)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # kB


def test_an_array_that_claims_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    """A header of 10^12 numbers over a few bytes takes no memory."""
    np.save(tmp_path / "u.npy", U)
    honest = (tmp_path / "u.npy").read_bytes()
    lying = honest.replace(b"(3000,), }          ", b"(1000000000000,), } ")
    assert len(lying) == len(honest) and lying != honest
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("t.npy", honest)
        archive.writestr("u.npy", lying)
        archive.writestr("y.npy", honest)
    with within(QUICK):
        assert "it holds fewer" in error_of(tmp_path / "a.npz")


def test_a_reader_that_crashes_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """scipy's reader may crash its process, which is therefore not this one."""
    scipy.io.savemat(tmp_path / "a.mat", {"t": T, "u": U, "y": Y})
    child = tmp_path / "child.py"
    child.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    monkeypatch.setattr("xy_sysid.imports.guarded.CHILD", child)
    assert "the process of the reader crashed (signal 11" in error_of(tmp_path / "a.mat")


def test_wrong_bytes_in_a_mat_file_never_end_in_a_traceback(tmp_path: Path) -> None:
    """Some numbers or one line, for any wrong byte."""
    scipy.io.savemat(tmp_path / "a.mat", {"a": {"t": T, "u": U, "y": Y, "names": np.array(["x", "yy"], object)}})
    whole = (tmp_path / "a.mat").read_bytes()
    random = np.random.default_rng(1)
    for _ in range(12):
        damaged = bytearray(whole)
        place = int(random.integers(128, 600))
        damaged[place : place + 4] = random.bytes(4)
        (tmp_path / "a.mat").write_bytes(damaged)
        with contextlib.suppress(XySysidError):
            load(tmp_path / "a.mat")


def chunk(packed: bytes, becomes: int) -> bytes:
    """An MCAP chunk record, compressed with zstd."""
    content = struct.pack("<QQQI", 0, 0, becomes, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", 6, len(content)) + content


@pytest.mark.parametrize(("becomes", "says"), [(1000, "it becomes more than 1000 bytes"), (1 << 40, "it says it becomes 1.1e+03 GB")])
def test_a_chunk_that_swells_is_left_out(tmp_path: Path, becomes: int, says: str) -> None:
    """200 MB of zeros in 6 kB, declared small or huge: the other chunks are read, with a note."""
    bag = tmp_path / "bag"
    in_chunks(bag, "mcap", 4000)
    file = the_file(bag)
    whole = file.read_bytes()
    (size,) = struct.unpack_from("<Q", whole, 9)
    place = 8 + 9 + size  # after the header record
    file.write_bytes(whole[:place] + chunk(zstd.compress(bytes(200_000_000)), becomes) + whole[place:-37])
    with within(QUICK + 3):
        recording = load(bag)
    assert_true_numbers(recording)
    assert len(recording) == 4000 and any(says in note and "left out" in note for note in recording.notes)


def test_a_compressed_file_that_swells_is_refused(tmp_path: Path) -> None:
    """A fully compressed bag: more than 200 times its size is not a recording, and does not fill the disk."""
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "a.db3.zstd").write_bytes(zstd.compress(bytes(400_000_000)))
    (bag / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  relative_file_paths: [a.db3.zstd]\n  compression_format: zstd\n  compression_mode: FILE\n"
    )
    with within(QUICK + 3):
        assert "becomes more than 67 MB" in error_of(bag)


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_one_bad_compressed_message_is_left_out(tmp_path: Path, storage: str) -> None:
    """Individually compressed messages are read from both storages; a damaged one loses its samples, and is counted."""
    path = tmp_path / "bag"
    with rosbags_writer(path, storage) as writer:
        connections = {name: writer.add_connection(f"/xy/{name}", ARRAY_TYPE, typestore=STORE) for name in ("voltage", "position")}
        for count, (kind, content) in enumerate(both(range(0, 2000, 20))):
            sizes = (len(content), 2 + len(content.axes))
            packed = zstd.compress(encode_array(("sample", ",".join(("seq", "time", *content.axes))), sizes, pack(content)))
            writer.write(connections[kind], count, packed[:-9] + b"damaged" if count == 100 else packed)
    meta = path / "metadata.yaml"
    text = meta.read_text().replace("compression_format: ''", "compression_format: zstd").replace("compression_mode: ''", "compression_mode: MESSAGE")
    assert "MESSAGE" in text
    meta.write_text(text)
    recording = load(path)
    assert_true_numbers(recording)
    assert len(recording) == 1980 and any("1 compressed messages are damaged" in note for note in recording.notes)


CRAFTED = {
    "a date that is none": "version: 5\n  starting_time: 2024-99-99 25:61:61\n",
    "infinite": "version: .inf\n  duration: {nanoseconds: .nan}\n  message_count: .inf\n",
    "100,000 digits": f"version: {'9' * 100_000}\n  message_count: {'9' * 100_000}\n",
    "aliases": "a: &a [x,x,x,x,x,x,x,x,x]\n"
    + "".join(f"  {b}: &{b} [{','.join(['*' + a] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "100,000 brackets": f"deep: {'[' * 100_000}\n",
    "deep": f"deep: {'[' * 500}{']' * 500}\n",
    "long": f"long: [{'a,' * 500_000}]\n",
    "objects": "version: !!python/object/apply:os.system ['touch hacked']\n",
}


@pytest.mark.parametrize("name", CRAFTED)
def test_crafted_metadata_does_not_matter(tmp_path: Path, name: str) -> None:
    """The files of the folder are read within seconds; alone it is one line within 2 s."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    file = the_file(bag)
    counts = f"  topics_with_message_count: [{{topic_metadata: {{name: /xy/voltage}}, message_count: {'9' * 100_000}}}]\n" if "digits" in name else ""
    (bag / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n  relative_file_paths: [{file.name}]\n  {CRAFTED[name]}{counts}")
    with within(QUICK):
        assert len(load(bag)) == 400
    file.unlink()
    with within(QUICK):
        error_of(bag)
    assert not Path("hacked").exists()


def test_pipes_are_refused_at_once(tmp_path: Path) -> None:
    """A FIFO never ends: as metadata, as a bag, as a table."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    (bag / "metadata.yaml").unlink()
    os.mkfifo(bag / "metadata.yaml")
    with within(QUICK):
        assert len(load(bag)) == 400
    for name in ("a.csv", "a.npz", "a.mat", "a.db3", "a.mcap"):
        os.mkfifo(tmp_path / name)
        with within(QUICK):
            assert "not a file but a pipe" in error_of(tmp_path / name)


@pytest.mark.parametrize("identity", [-1, -(2**40), 2**40])
def test_odd_topic_ids_are_read(tmp_path: Path, identity: int) -> None:
    """Negative and huge ids neither hit another topic nor fill the memory."""
    bag = a_bag(tmp_path / "bag", [*both(range(0, 400, 20)), ("/other", numbered(0))])
    with contextlib.closing(sqlite3.connect(the_file(bag))) as database:
        (old,) = database.execute("SELECT id FROM topics WHERE name='/xy/voltage'").fetchone()
        database.execute("UPDATE topics SET id=? WHERE id=?", (identity, old))
        database.execute("UPDATE messages SET topic_id=? WHERE topic_id=?", (identity, old))
        database.commit()
    with within(QUICK):
        recording = load(bag)
    assert_true_numbers(recording)
    assert len(recording) == 400


def changed(content: Block, **values: Any) -> Block:
    """A block with some of its parts replaced."""
    return Block(**({"axes": content.axes, "seq": content.seq, "time": content.time, "values": content.values} | values))


def test_numbers_that_are_none_cost_their_samples_only(tmp_path: Path) -> None:
    """NaN in seq, 1e300 in a position: these samples are left out and counted, the rest is complete."""
    messages = both(range(0, 2000, 20))
    seq = messages[10][1].seq.copy()
    seq[3] = np.nan
    values = messages[21][1].values.copy()
    values[7, 1] = 1e300
    messages[10] = (messages[10][0], changed(messages[10][1], seq=seq))
    messages[21] = (messages[21][0], changed(messages[21][1], values=values))
    recording = load(a_bag(tmp_path / "bag", messages))
    assert_true_numbers(recording)
    assert len(recording) == 1998 and sum("rows of" in note and "not numbers" in note for note in recording.notes) == 2


def test_an_axis_without_numbers_is_left_out(tmp_path: Path) -> None:
    """All NaN on y: x is read completely, with a note; in a bag as in a table."""
    hollow = [
        (kind, changed(content, values=np.column_stack((content.values[:, 0], np.full(20, np.nan)))) if kind == "position" else content)
        for kind, content in both(range(0, 2000, 20))
    ]
    nan = np.full(len(T), np.nan)
    table = csv_of(tmp_path, {"time": T, "x_voltage": U, "y_voltage": U, "x_position": Y, "y_position": nan})
    for path, rows in ((a_bag(tmp_path / "bag", hollow), 2000), (table, len(T))):
        recording = load(path)
        assert (recording.axes, len(recording)) == (("x",), rows)
        assert any("axis y has hardly any numbers" in note for note in recording.notes)
    path = csv_of(tmp_path, {"time": T, "seq": np.where(np.arange(len(T)) == 5, np.nan, np.arange(len(T))), "x_voltage": U, "x_position": Y})
    assert len(load(path)) == len(T) - 1


def test_axes_of_one_name_are_left_out(tmp_path: Path) -> None:
    """x is ambiguous; y is read. For blocks and for joint states."""
    messages = [(kind, Block(("x", "y", "x"), c.seq, c.time, np.column_stack((c.values, 7 * c.values[:, 0])))) for kind, c in both(range(0, 400, 20))]
    recording = load(a_bag(tmp_path / "bag", messages))
    assert recording.axes == ("y",) and any("has x twice" in note for note in recording.notes)
    path = tmp_path / "joints"
    with rosbags_writer(path, "sqlite3") as writer:
        connection = writer.add_connection("/joint_states", JOINT_TYPE, typestore=STORE)
        for count in range(500):
            values = np.array([count, 2.0 * count, 3.0 * count])
            writer.write(connection, count, joint_state(count * 10_000_000, values, np.sin(values), ("x", "y", "x")))
    recording = load(path)
    assert recording.axes == ("y",) and any("has x twice" in note for note in recording.notes)
    np.testing.assert_array_equal(recording.position[:, 0], 2.0 * np.arange(500))


def test_one_message_with_other_columns_does_not_decide(tmp_path: Path) -> None:
    """Even as the first block: the columns of most samples are read, with a note about the rest."""
    messages = both(range(0, 2000, 20))
    messages[0] = ("voltage", changed(messages[0][1], axes=("y", "x")))
    recording = load(a_bag(tmp_path / "bag", messages))
    assert_true_numbers(recording)
    assert len(recording) == 1980 and any("20 samples of voltage have other columns than x, y" in note for note in recording.notes)


def test_a_table_of_very_many_columns_is_refused_at_once(tmp_path: Path) -> None:
    """900,000 cells in a row, 20,000 arrays in a file: one line within 2 s."""
    (tmp_path / "a.csv").write_text(",".join(["time", "u", "y"] * 300_000) + "\n" + ",".join(["1"] * 900_000) + "\n")
    np.save(tmp_path / "u.npy", U[:3])
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        for number in range(20_000):
            archive.writestr(f"a{number}.npy", (tmp_path / "u.npy").read_bytes())
    for name in ("a.csv", "a.npz"):
        with within(QUICK):
            assert "10000" in error_of(tmp_path / name)


def test_numbers_beyond_any_unit_are_refused(tmp_path: Path) -> None:
    """A position of 1e145 m made the eigenvalues of a fit fail to converge."""
    np.savez(tmp_path / "a.npz", t=T, u=U, y=1e150 * Y)
    assert "the output reaches" in error_of(tmp_path / "a.npz") and "--scale" in error_of(tmp_path / "a.npz")


def a_slip(path: Path, kinds: tuple[str, ...], first: int = 1000, size: int = 1) -> Path:
    """2000 samples; the counter of ``kinds`` slips at sample ``first``, while its time continues."""
    messages = []
    for kind, content in both(range(0, 2000, 20)):
        slipped = kind in kinds and content.seq[0] >= first
        messages.append((kind, changed(content, seq=content.seq + size) if slipped else content))
    return a_bag(path, messages)


def test_a_counter_that_slips_is_noticed_with_the_place(tmp_path: Path) -> None:
    """By one in the second half of one stream: samples that would be paired wrongly are left out; in both streams there is only a note."""
    recording = load(a_slip(tmp_path / "one", ("voltage",), first=1200))
    assert_true_numbers(recording)
    assert len(recording) == 1200 and recording.seq[-1] == 1199
    assert any("counter of the voltage slips" in note and "by +1 at sample 1201" in note for note in recording.notes)
    assert any("the part whose stamps agree best is read, 1200 of" in note for note in recording.notes)
    back = load(a_slip(tmp_path / "back", ("position",), first=800, size=-1))
    assert any("counter of the position slips" in note and "by -1" in note for note in back.notes)
    assert_true_numbers(back)
    assert len(back) == 800, "the second half is longer, and paired wrongly"
    both_slip = load(a_slip(tmp_path / "both", ("voltage", "position")))
    assert len(both_slip) == 2000 and sum("slips" in note for note in both_slip.notes) == 2


@pytest.mark.parametrize("kinds", [("voltage",), ("position",), ("voltage", "position")])
def test_a_clock_that_jumps_is_noticed_with_the_place(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """By 50 ms in one or both streams: samples are still paired by number, the rate is right, and a note gives the place."""
    messages = []
    for kind, content in both(range(0, 2000, 20)):
        jumped = kind in kinds and content.seq[0] >= 600
        messages.append((kind, changed(content, time=content.time + 0.05) if jumped else content))
    recording = load(a_bag(tmp_path / "bag", messages))
    assert_true_numbers(recording)
    assert len(recording) == 2000 and recording.sampling_rate == RATE
    for kind in kinds:
        assert any(f"the time of the {kind} jumps: +50 ms at sample 600" in note for note in recording.notes)
    assert sum("jumps" in note for note in recording.notes) == len(kinds)


def test_a_jump_of_time_in_a_table_with_a_counter_is_noticed(tmp_path: Path) -> None:
    """The same for a CSV with seq."""
    count = np.arange(len(T), dtype=np.float64)
    recording = load(csv_of(tmp_path, {"time": np.where(count >= 900, T + 0.2, T), "seq": count, "u": U, "y": Y}))
    assert any("the time of the file jumps: +200 ms at sample 900" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("end", "kept", "says"),
    [
        ("0.300,1.500,2.5", 30, "ends inside row 32"),
        ("0.300,1.5", 30, "ends inside row 32"),
        ("0.300,", 30, "ends inside row 32"),
        ("0.300,1.500,2.500e-", 30, "ends inside row 32"),
        ("0.300,1.500,2.500", 31, "its last number may be wrong"),
        ("0.300,1.500,2.500\n", 31, ""),
    ],
)
def test_a_csv_that_ends_inside_a_number_says_so(tmp_path: Path, end: str, kept: int, says: str) -> None:
    """An incomplete last row is left out; if that cannot be determined, a note says so."""
    rows = [f"{k / 100:.3f},{k % 7:.3f},{k % 5:.3f}" for k in range(30)]
    (tmp_path / "a.csv").write_text("\n".join(["time,u,y", *rows, end]))
    recording = load(tmp_path / "a.csv")
    assert len(recording) == kept
    assert not says or any(says in note for note in recording.notes)
    assert says or not any("row" in note or "wrong" in note for note in recording.notes)


def test_text_as_other_systems_write_it(tmp_path: Path) -> None:
    """UTF-16 and the letters of Windows: µm and ° are read."""
    text = "time,u,Weg [µm]\n" + "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(60))
    for code in ("utf-16", "cp1252", "utf-8", "utf-8-sig"):
        (tmp_path / "a.csv").write_bytes(text.encode(code))
        assert load(tmp_path / "a.csv").position[1, 0] == pytest.approx(1e-6)
