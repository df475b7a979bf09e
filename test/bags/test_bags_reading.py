"""Bags of this or other recorders give their samples, in order and in blocks of limited size."""

from __future__ import annotations

import contextlib
import importlib
import shutil
import sqlite3
import sys
import zlib
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import yaml
from helpers.bag_making import STORE, a_bag, both, numbered, rosbags_writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader

from xy_sysid.bags import Bag, BagWriter, stream_blocks
from xy_sysid.bags.cdr import ARRAY_TYPE, encode_array
from xy_sysid.bags.checksum import crc32
from xy_sysid.bags.writing import Storage
from xy_sysid.samples.block import Block, FloatArray, columns, pack

STORAGES = pytest.mark.parametrize("storage", ["sqlite3", "mcap"])


def joined(blocks: Sequence[tuple[str, Block]], kind: str) -> FloatArray:
    return np.concatenate([np.column_stack((b.seq, b.time, b.values)) for k, b in blocks if k == kind])


def test_checksums_are_those_of_zlib_whoever_computes_them() -> None:
    """The check value of CRC-32, and some bytes."""
    content = bytes(range(256)) * 97
    assert crc32(b"123456789") == 0xCBF43926
    assert crc32(memoryview(content)) == zlib.crc32(content)


def written_by_rosbags(path: Path, storage: str, mode: CompressionMode = CompressionMode.NONE, count: int = 300) -> Path:
    writer = rosbags_writer(path, storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topics = {name: writer.add_connection(f"/xy/{name}", ARRAY_TYPE, typestore=STORE) for name in ("voltage", "position")}
        for index, (kind, content) in enumerate(both(range(0, 20 * count, 20))):
            writer.write(topics[kind], index, encode_array(("sample", columns(content.axes)), (20, 4), pack(content)))
    return path


@STORAGES
@pytest.mark.parametrize("rows", [1, 20, 200, 3000])
def test_blocks_come_back_number_for_number(tmp_path: Path, storage: str, rows: int) -> None:
    """Blocks of any size, also those that fill many pages of a database, are read exactly and in log order."""
    messages = both(range(0, 12_000, rows), rows)
    found = list(stream_blocks(a_bag(tmp_path / "bag", messages, storage=storage)))
    for kind in ("voltage", "position"):
        np.testing.assert_array_equal(joined(found, kind), joined(messages, kind))


@pytest.mark.parametrize("size", [512, 4096, 65_536])
def test_a_database_with_pages_of_any_size_is_read(tmp_path: Path, size: int) -> None:
    """``ros2 bag`` writes pages of 4096 bytes, our recorder larger ones."""
    messages = both(range(0, 12_000, 20), 20)
    bag = a_bag(tmp_path / "bag", messages, storage="sqlite3")
    file = next(bag.glob("*.db3"))
    with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as database:
        database.execute(f"PRAGMA page_size={size}")
        database.execute("VACUUM")
        assert database.execute("PRAGMA page_size").fetchone() == (size,)
    found = list(stream_blocks(bag))
    for kind in ("voltage", "position"):
        np.testing.assert_array_equal(joined(found, kind), joined(messages, kind))


@STORAGES
def test_the_two_topics_stay_side_by_side(tmp_path: Path, storage: str) -> None:
    """At no point of the stream is one topic more than 2000 samples ahead, and blocks are not smaller than necessary."""
    place = {"voltage": 0.0, "position": 0.0}
    blocks = 0
    for kind, content in stream_blocks(a_bag(tmp_path / "bag", both(range(0, 100_000, 20)), storage=storage)):
        place[kind] = content.seq[-1]
        blocks += 1
        assert abs(place["voltage"] - place["position"]) <= 2020
    assert place == {"voltage": 99_999, "position": 99_999}
    assert blocks < 2 * 100_000 / 1000


@STORAGES
def test_the_log_order_is_kept(tmp_path: Path, storage: str) -> None:
    """A block that arrived late also comes late from the bag."""
    order = [0, 20, 60, 80, 40, 100]
    found = [b for k, b in stream_blocks(a_bag(tmp_path / "bag", both(order), storage=storage)) if k == "voltage"]
    assert np.concatenate([b.seq for b in found])[::20].tolist() == order


@STORAGES
@pytest.mark.parametrize("mode", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE, CompressionMode.STORAGE])
def test_a_bag_of_plain_rosbags_is_read(tmp_path: Path, storage: str, mode: CompressionMode) -> None:
    """Bags of other recorders are read with all compressions of rosbag2."""
    if (storage, mode) in (("sqlite3", CompressionMode.STORAGE), ("mcap", CompressionMode.MESSAGE)):
        pytest.skip("rosbag2 has no such combination")
    notes: list[str] = []
    found = list(stream_blocks(written_by_rosbags(tmp_path / "bag", storage, mode), notes=notes))
    np.testing.assert_array_equal(joined(found, "position"), joined(both(range(0, 6000, 20)), "position"))
    assert notes == []


def test_an_mcap_bag_whose_messages_are_compressed_one_by_one_is_read(tmp_path: Path) -> None:
    """As ``ros2 bag record -s mcap --compression-mode message --compression-format zstd`` writes it; the library of the other test cannot."""
    zstd = pytest.importorskip("backports.zstd") if sys.version_info < (3, 14) else importlib.import_module("compression.zstd")
    with rosbags_writer(tmp_path / "bag", "mcap") as writer:
        topics = {name: writer.add_connection(f"/xy/{name}", ARRAY_TYPE, typestore=STORE) for name in ("voltage", "position")}
        for index, (kind, content) in enumerate(both(range(0, 6000, 20))):
            writer.write(topics[kind], index, zstd.compress(encode_array(("sample", columns(content.axes)), (20, 4), pack(content))))
    told = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    told["rosbag2_bagfile_information"] |= {"compression_mode": "MESSAGE", "compression_format": "zstd"}
    (tmp_path / "bag" / "metadata.yaml").write_text(yaml.safe_dump(told))
    notes: list[str] = []
    found = list(stream_blocks(tmp_path / "bag", notes=notes))
    np.testing.assert_array_equal(joined(found, "position"), joined(both(range(0, 6000, 20)), "position"))
    assert notes == []


@STORAGES
def test_a_bare_file_needs_no_metadata(tmp_path: Path, storage: str) -> None:
    """The .db3 or .mcap alone is a recording too."""
    bag = written_by_rosbags(tmp_path / "bag", storage)
    (file,) = [item for item in bag.iterdir() if item.suffix != ".yaml"]
    alone = tmp_path / f"moved{file.suffix}"
    shutil.copy(file, alone)
    assert len(joined(list(stream_blocks(alone)), "voltage")) == 6000


@STORAGES
def test_a_bag_split_over_files_is_one_recording(tmp_path: Path, storage: str) -> None:
    """The files are read one after the other, in the order of metadata.yaml."""
    first = a_bag(tmp_path / "bag", both(range(0, 1000, 20)), storage=storage)
    second = a_bag(tmp_path / "rest", both(range(1000, 2000, 20)), storage=storage)
    (more,) = [item for item in second.iterdir() if item.suffix != ".yaml"]
    shutil.copy(more, first / more.name)
    content = yaml.safe_load((first / "metadata.yaml").read_text())
    content["rosbag2_bagfile_information"]["relative_file_paths"].append(more.name)
    for topic in content["rosbag2_bagfile_information"]["topics_with_message_count"]:
        topic["message_count"] = 100
    (first / "metadata.yaml").write_text(yaml.safe_dump(content))
    notes: list[str] = []
    parts: list[float] = []
    found = joined(list(stream_blocks(first, notes=notes, progress=parts.append)), "voltage")
    assert found[:, 0].tolist() == list(range(2000))
    assert notes == []
    assert parts[-1] == 1.0 or storage == "mcap"
    assert all(a <= b for a, b in pairwise(parts))


@STORAGES
def test_foreign_topics_are_passed_over(tmp_path: Path, storage: str) -> None:
    """Other topics in between, small or large, have no effect."""
    messages = both(range(0, 4000, 20))
    with BagWriter(tmp_path / "bag", cast("Storage", storage)) as writer:
        for count, (kind, content) in enumerate(messages):
            writer.write_raw("/camera", "sensor_msgs/msg/Image", bytes(100_000 if count % 50 == 7 else 300), count)
            writer.write_block(f"/xy/{kind}", content, count)
    found = list(stream_blocks(tmp_path / "bag"))
    np.testing.assert_array_equal(joined(found, "voltage"), joined(messages, "voltage"))
    with Bag(tmp_path / "bag") as bag:
        assert bag.kind("/camera") == "sensor_msgs/msg/Image"


def test_a_database_with_holes_is_read(tmp_path: Path) -> None:
    """Deleted rows, large rows and pages out of order: what remains is read, as plain rosbags reads it."""
    import sqlite3

    bag = a_bag(tmp_path / "bag", both(range(0, 20_000, 20)))
    with sqlite3.connect(bag / "bag.db3") as database:
        database.execute("DELETE FROM messages WHERE id % 7 = 3")
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages WHERE id % 7 = 4").fetchall()
        large = [(topic, time, encode_array(("sample", "seq,time,x,y"), (900, 4), pack(numbered(50_000, 900)))) for topic, time, _ in rows[:20]]
        database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?,?,?)", rows + large)
    database.close()
    (bag / "metadata.yaml").unlink()  # and with it the checksums of the earlier content
    found = list(stream_blocks(bag, chunk_samples=10**9))
    with Reader(bag / "bag.db3") as reader:
        expected = [STORE.deserialize_cdr(raw, ARRAY_TYPE).data for c, _, raw in reader.messages() if c.topic == "/xy/voltage"]
    ours, theirs = joined(found, "voltage"), np.concatenate(expected).reshape(-1, 4)
    np.testing.assert_array_equal(ours[np.lexsort(ours.T)], theirs[np.lexsort(theirs.T)])


def test_rows_that_only_a_log_holds_are_read(tmp_path: Path) -> None:
    """In WAL mode the newest rows of a database are in a separate file; they are read, too."""
    import sqlite3

    bag = a_bag(tmp_path / "bag", both(range(0, 2000, 20)))
    database = sqlite3.connect(bag / "bag.db3")
    database.execute("PRAGMA journal_mode=WAL")
    rows = database.execute("SELECT topic_id, timestamp FROM messages WHERE id <= 2 ORDER BY id").fetchall()
    extra = encode_array(("sample", "seq,time,x,y"), (20, 4), pack(numbered(2000)))
    database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?,?,?)", [(*row, extra) for row in rows])
    database.commit()
    assert (bag / "bag.db3-wal").stat().st_size > 0
    assert joined(list(stream_blocks(bag)), "voltage")[-1, 0] == 2019
    database.close()
