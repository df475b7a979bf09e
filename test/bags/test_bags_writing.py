"""Other tools open a bag written here, and it survives the end of its writer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from helpers import ROOT
from helpers.bag_making import STORE, a_bag, both, joint_state, numbered
from rosbags.rosbag2 import Reader

from xy_sysid.bags import BagWriter
from xy_sysid.bags.cdr import ARRAY_TYPE, JOINT_TYPE
from xy_sysid.bags.writing import Storage
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import load
from xy_sysid.samples.block import pack

STORAGES = pytest.mark.parametrize("storage", ["sqlite3", "mcap"])

ENDLESS = """
import sys, time
from dataclasses import replace
sys.path.insert(0, {root!r} + "/test")
from helpers.bag_making import numbered
from xy_sysid.bags import BagWriter
writer = BagWriter({path!r}, {storage!r})
begin = time.monotonic()
for count in range(10**9):
    block = numbered(20 * count)
    for kind, sent in (("voltage", block), ("position", replace(block, values=-block.values))):
        writer.write_block("/xy/" + kind, sent, 10_000_000 * count)
    print(20 * (count + 1), flush=True)
    time.sleep(max(0.0, begin + 0.01 * count - time.monotonic()))
"""


@STORAGES
def test_plain_rosbags_opens_what_is_written(tmp_path: Path, storage: str) -> None:
    """rosbags reads the same topics, types, counts, times and messages, from the folder and from the file alone."""
    messages = both(range(0, 4000, 20))
    bag = a_bag(tmp_path / "bag", messages, storage=storage)
    (file,) = [item for item in bag.iterdir() if item.suffix != ".yaml"]
    for path in (bag, file):
        with Reader(path) as reader:
            assert {c.topic: (c.msgtype, c.msgcount) for c in reader.connections} == {f"/xy/{n}": (ARRAY_TYPE, 200) for n in ("voltage", "position")}
            assert (reader.start_time, reader.end_time) == (1_000_000_000, 1_000_000_000 + 399 * 1_000_000 + 1)
            assert all(c.msgdef.data.startswith("#") or "float64[]" in c.msgdef.data for c in reader.connections)
            for (kind, content), (connection, _, raw) in zip(messages, reader.messages(), strict=True):
                assert connection.topic == f"/xy/{kind}"
                np.testing.assert_array_equal(STORE.deserialize_cdr(raw, ARRAY_TYPE).data, pack(content))


@STORAGES
def test_any_message_can_be_kept(tmp_path: Path, storage: str) -> None:
    """Serialized messages of any type, also an unknown one, and arrays with any labels are kept byte for byte."""
    raw = joint_state(5, np.array([1.0, 2.0]))
    with BagWriter(tmp_path / "bag", cast("Storage", storage)) as writer:
        writer.write_raw("/joint_states", JOINT_TYPE, raw, 10)
        writer.write_raw("/secret", "acme_msgs/msg/Secret", b"\x00\x01\x00\x00abc", 11)
        writer.write_array("/xy/frf/x", ("line", "frequency,real"), (3, 2), np.arange(6.0), 12)
        with pytest.raises(BadInput, match="One topic carries one type"):
            writer.write_raw("/secret", JOINT_TYPE, raw, 13)
    with Reader(tmp_path / "bag") as reader:
        found = {connection.topic: bytes(data) for connection, _, data in reader.messages()}
    assert found["/joint_states"] == raw and found["/secret"] == b"\x00\x01\x00\x00abc"
    assert STORE.deserialize_cdr(found["/xy/frf/x"], ARRAY_TYPE).layout.dim[1].label == "frequency,real"


@STORAGES
def test_a_killed_recorder_loses_at_most_two_seconds(tmp_path: Path, storage: str) -> None:
    """After kill -9, all data older than 2 s are readable, here and with rosbags."""
    path = tmp_path / "bag"
    script = ENDLESS.format(root=str(ROOT), path=str(path), storage=storage)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        written = 0
        while written < 5000:
            written = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        rest = process.stdout.read().split()
    written = int(rest[-1]) if rest else written
    recording = load(path)
    assert written - 4000 <= len(recording) <= written + 20
    np.testing.assert_array_equal(recording.voltage[:, 0], np.arange(len(recording)))
    assert len(recording.runs()) == 1 and recording.sampling_rate == 2000
    with Reader(path) as reader:
        assert sum(1 for _ in reader.messages()) * 20 >= 2 * (written - 4000)


@STORAGES
def test_flush_makes_the_bag_complete_so_far(tmp_path: Path, storage: str) -> None:
    """After a flush the bag can be read while it is still being written."""
    writer = BagWriter(tmp_path / "bag", cast("Storage", storage))
    for kind, content in both(range(0, 400, 20)):
        writer.write_block(f"/xy/{kind}", content, 1)
    writer.flush()
    assert len(load(tmp_path / "bag")) == 400
    for kind, content in both(range(400, 600, 20)):
        writer.write_block(f"/xy/{kind}", content, 2)
    writer.close()
    writer.close()
    assert len(load(tmp_path / "bag")) == 600 and load(tmp_path / "bag").notes == ()
    with pytest.raises(BadInput, match="closed"):
        writer.write_block("/xy/voltage", numbered(0), 3)


@STORAGES
def test_writing_waits_for_nothing(tmp_path: Path, storage: str) -> None:
    """A recorder needs less than a tenth of a processor in real time with messages of 20 samples."""
    messages = both(range(0, 20_000, 20))
    begin = time.process_time()
    a_bag(tmp_path / "bag", messages, storage=storage)
    assert (time.process_time() - begin) / len(messages) < 1e-3


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    """An existing folder or file is not changed, and one line says so."""
    a_bag(tmp_path / "bag", both([0]))
    for path in (tmp_path / "bag", tmp_path):
        with pytest.raises(BadRecording, match="exists already"):
            BagWriter(path)
    (tmp_path / "x.mcap").write_bytes(b"mine")
    with pytest.raises(BadRecording, match="exists already"):
        BagWriter(tmp_path / "x.mcap")
    assert (tmp_path / "x.mcap").read_bytes() == b"mine"


def test_a_wrong_storage_or_place_is_one_line(tmp_path: Path) -> None:
    """The error gives the value, the allowed values and the next action."""
    with pytest.raises(BadInput, match="allowed: sqlite3, mcap"):
        BagWriter(tmp_path / "bag", cast("Storage", "rosbag1"))
    with pytest.raises(BadInput, match="mcap"):
        BagWriter(tmp_path / "bag.mcap", "sqlite3")
    (tmp_path / "file").write_text("")
    with pytest.raises(BadRecording, match="cannot be written"):
        BagWriter(tmp_path / "file" / "bag")


@STORAGES
def test_what_is_flushed_is_on_the_disk(tmp_path: Path, storage: str) -> None:
    """Power failure: each flush waits for the disk (the system calls are counted), for the file with samples and for metadata.yaml."""
    program = f"""
import sys
sys.path.insert(0, {str(ROOT)!r} + "/test")
from helpers.bag_making import numbered
from xy_sysid.bags import BagWriter
writer = BagWriter({str(tmp_path / "bag")!r}, {storage!r})
import os
calls = []
for name in ("fsync", "fdatasync"):
    def told(handle, real=getattr(os, name)):
        calls.append(os.readlink(f"/proc/self/fd/{{handle}}"))
        real(handle)
    setattr(os, name, told)
writer.write_block("/xy/voltage", numbered(0), 0)
writer.flush()
print(sum(name.endswith("metadata.yaml.tmp") for name in calls), sum(name.endswith(".mcap") for name in calls))
print(writer.writer.database.execute("PRAGMA synchronous").fetchone()[0] if {storage!r} == "sqlite3" else "")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=True)
    counts, level = done.stdout.splitlines()
    assert counts == ("1 0" if storage == "sqlite3" else "1 1")
    assert storage == "mcap" or level == "2"  # sqlite's value for FULL
