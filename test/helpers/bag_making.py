"""Samples, blocks and bags for the tests of reading and writing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from xy_sysid.bags import BagWriter
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.bags.writing import Storage
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.recording import Recording

STORE: Any = get_typestore(Stores.ROS2_JAZZY)
RATE = 2000.0
PLUGINS = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}


def a_recording(rows: int = 1000, axes: tuple[str, ...] = ("x", "y"), **changes: Any) -> Recording:
    """Random samples at 2 kHz without a gap."""
    random = np.random.default_rng(7)
    seq = np.arange(rows)
    made: dict[str, Any] = {
        "sampling_rate": RATE,
        "axes": axes,
        "seq": seq,
        "time": seq / RATE,
        "voltage": random.normal(size=(rows, len(axes))),
        "position": 1e-3 * random.normal(size=(rows, len(axes))),
    }
    return Recording(**(made | changes))


def block(values: FloatArray, first: int = 0, axes: tuple[str, ...] = ("x", "y"), rate: float = RATE) -> Block:
    """(n, axes) values as samples ``first``, ``first + 1``, ..."""
    seq = np.arange(first, first + len(values), dtype=np.float64)
    return Block(axes, seq, seq / rate, values)


def numbered(first: int, rows: int = 20, axes: tuple[str, ...] = ("x", "y"), scale: float = 1.0) -> Block:
    """A block whose values identify their sample: scale * seq, and similar for each axis."""
    seq = np.arange(first, first + rows, dtype=np.float64)
    return block(np.column_stack([scale * (seq + 0.25 * i) for i in range(len(axes))]), first, axes)


def a_bag(path: Path, messages: Iterable[tuple[str, Block]], **options: Any) -> Path:
    """A bag with these blocks in this order; a topic without "/" is in /xy."""
    with BagWriter(path, **options) as writer:
        for count, (topic, content) in enumerate(messages):
            writer.write_block(topic if "/" in topic else f"/xy/{topic}", content, 1_000_000_000 + count * 1_000_000)
    return path


def both(firsts: Iterable[int], rows: int = 20) -> list[tuple[str, Block]]:
    """Alternating voltage and position blocks that begin at these samples."""
    return [(kind, numbered(first, rows, scale=scale)) for first in firsts for kind, scale in (("voltage", 1.0), ("position", 1e-3))]


NONE = np.zeros(0)


def joint_state(
    stamp: int,
    position: FloatArray,
    effort: FloatArray | None = None,
    names: tuple[str, ...] = ("x", "y"),
    frame: str = "base",
    velocity: FloatArray = NONE,
) -> bytes:
    """A serialized sensor_msgs/JointState; stamp in ns."""
    types = STORE.types
    header = types["std_msgs/msg/Header"](stamp=types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id=frame)
    message = types[JOINT_TYPE](header=header, name=list(names), position=position, velocity=velocity, effort=NONE if effort is None else effort)
    return bytes(STORE.serialize_cdr(message, JOINT_TYPE))


def rosbags_writer(path: Path, storage: str) -> Writer:
    """A plain rosbags writer, to be opened as a context."""
    return Writer(path, version=9, storage_plugin=PLUGINS[storage])


def assert_same(one: Recording, other: Recording) -> None:
    """Equal in every number, unit and name."""
    assert (one.axes, one.input_unit, one.output_unit, one.sampling_rate) == (other.axes, other.input_unit, other.output_unit, other.sampling_rate)
    for name in ("seq", "time", "voltage", "position"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert (one.reference is None) == (other.reference is None)
    if one.reference is not None and other.reference is not None:
        np.testing.assert_array_equal(one.reference, other.reference)


def the_file(bag: Path) -> Path:
    (file,) = [item for item in bag.iterdir() if item.suffix in (".db3", ".mcap")]
    return file


def in_chunks(path: Path, storage: str, rows: int) -> None:
    """A bag that is flushed after every 400 samples."""
    with BagWriter(path, cast("Storage", storage)) as writer:
        for count, (kind, content) in enumerate(both(range(0, rows, 20))):
            writer.write_block(f"/xy/{kind}", content, count)
            if count % 40 == 39:
                writer.flush()


def assert_true_numbers(recording: Recording) -> None:
    """Assert that samples have the values that the test wrote for their numbers."""
    np.testing.assert_array_equal(recording.voltage, recording.seq[:, None] + [0.0, 0.25])
    np.testing.assert_array_equal(recording.position, 1e-3 * (recording.seq[:, None] + np.array([0.0, 0.25])))
