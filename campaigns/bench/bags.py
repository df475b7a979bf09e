"""Speed of reading bags, compared with deserializing message by message in the same run.

The reference is the plain loop with rosbags: read, deserialize, take the numbers. Times are processor time of all threads, user and
system, so that other work on the machine does not count. A third of the time
to stream blocks is the kernel's copy of the file from its cache. Our recorder writes sqlite3 files in pages of 32 KB,
``ros2 bag`` in sqlite's usual 4 KB. Streams of sqlite3 include the check of our recorder's checksums, for which the file is
read once more before the first sample is passed on. Joint states with effort are numbered while they are streamed, as the nodes do.
"""

from __future__ import annotations

import contextlib
import sqlite3
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from campaigns.bench.tables import Table, at_least
from xy_sysid.bags import BagWriter, stream_blocks
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.imports import load
from xy_sysid.samples.block import Block

RATE, ROWS, REPEATS = 2000, 20, 5
MINUTES, BRIEF = 5.0, 0.05
STORE = get_typestore(Stores.ROS2_JAZZY)


def write_blocks(path: Path, samples: int) -> int:
    """Write two axes at 2 kHz, 20 rows per message, voltage and position; returns the number of samples in the bag."""
    values = np.random.default_rng(0).normal(size=(2, ROWS, 2))
    with BagWriter(path, "mcap" if "mcap" in path.name else "sqlite3") as writer:
        for first in range(0, samples, ROWS):
            seq = np.arange(first, first + ROWS, dtype=np.float64)
            for topic, block in zip(("/xy/voltage", "/xy/position"), values, strict=True):
                writer.write_block(topic, Block(("x", "y"), seq, seq / RATE, block), int(first * 1e9 / RATE))
    return 2 * samples


def write_usual(path: Path, samples: int) -> int:
    """The same with sqlite's default page size."""
    count = write_blocks(path, samples)
    with contextlib.closing(sqlite3.connect(next(path.glob("*.db3")), isolation_level=None)) as database:
        database.execute("PRAGMA page_size=4096")
        database.execute("VACUUM")
    return count


def write_joints(path: Path, samples: int) -> int:
    """Write two joints at 2 kHz, one sample per message; returns the number of samples."""
    types = STORE.types
    stamp, (position, velocity, effort) = types["builtin_interfaces/msg/Time"], np.random.default_rng(0).normal(size=(3, ROWS, 2))
    with BagWriter(path, "mcap" if "mcap" in path.name else "sqlite3") as writer:
        for index in range(samples):
            now = 10**18 + index * 10**9 // RATE
            header = types["std_msgs/msg/Header"](stamp=stamp(sec=now // 10**9, nanosec=now % 10**9), frame_id="")
            row = index % ROWS
            message = types[JOINT_TYPE](header=header, name=["x", "y"], position=position[row], velocity=velocity[row], effort=effort[row])
            writer.write_raw("/joint_states", JOINT_TYPE, bytes(STORE.serialize_cdr(message, JOINT_TYPE)), now)
    return samples


def loop(path: Path) -> None:
    """The reference: rosbags deserializes each message, and its numbers are read."""
    with Reader(path) as reader:
        for connection, _, raw in reader.messages():
            message = STORE.deserialize_cdr(raw, connection.msgtype)
            _ = getattr(message, "data", None)


def stream(path: Path) -> None:
    """Read every sample as blocks, in log order."""
    for _ in stream_blocks(path):
        pass


def best(work: Callable[[Path], object], path: Path, repeats: int) -> float:
    """Least processor time of some runs, s; the first one compiles and is not counted."""
    times = []
    for _ in range(repeats + 1):
        begin = time.process_time()
        work(path)
        times.append(time.process_time() - begin)
    return min(times[1:])


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Million samples per second, and ratios to the loop that deserializes message by message."""
    samples = int((BRIEF if short else MINUTES) * 60 * RATE) // ROWS * ROWS
    few = 1 if short else REPEATS
    found: dict[str, tuple[float, float, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, write in (
            ("blocks of 20, sqlite3", write_blocks),
            ("blocks of 20, sqlite3 of 4 KB", write_usual),
            ("blocks of 20, mcap", write_blocks),
            ("joint states, sqlite3", write_joints),
            ("joint states, mcap", write_joints),
        ):
            path = Path(folder) / name.replace(" ", "_").replace(",", "")
            count = write(path, samples)
            found[name] = count / best(loop, path, min(few, 2)), count / best(stream, path, few), count / best(load, path, few)
            report(f"bags: {name} measured")
    per_message = found["joint states, sqlite3"][0]
    rows = tuple((name, *(f"{x / 1e6:.2f}" for x in three), f"{three[1] / three[0]:.1f}x") for name, three in found.items())
    checks = tuple(at_least(f"{name}: streamed over its own loop", three[1] / three[0], 20.0) for name, three in found.items())
    checks += (at_least("blocks (sqlite3) over a loop with one message for each sample", found["blocks of 20, sqlite3"][1] / per_message, 20.0),)
    columns = ("bag", "loop, M samples/s", "streamed", "loaded and paired", "streamed over loop")
    return Table("Reading bags", __doc__.split("\n\n", 1)[-1], columns, rows, checks)
