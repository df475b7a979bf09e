"""How fast bags are read, against deserializing message by message, measured in one run.

    python bench/bags.py [--minutes 5] [--json]

The yardstick is the plain loop that everyone writes with rosbags: read, deserialize, take the numbers.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from xy_sysid.bags import BagWriter, stream_blocks
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.imports import load
from xy_sysid.stream import Block

RATE, ROWS, REPEATS = 2000, 20, 3
STORE = get_typestore(Stores.ROS2_JAZZY)


def write_blocks(path: Path, samples: int) -> int:
    """Two axes at 2 kHz, 20 rows a message, voltage and position; the number of samples read from it."""
    values = np.random.default_rng(0).normal(size=(ROWS, 2))
    with BagWriter(path, "mcap" if "mcap" in path.name else "sqlite3") as writer:
        for first in range(0, samples, ROWS):
            seq = np.arange(first, first + ROWS, dtype=np.float64)
            for topic in ("/xy/voltage", "/xy/position"):
                writer.write_block(topic, Block(("x", "y"), seq, seq / RATE, values), int(first * 1e9 / RATE))
    return 2 * samples


def write_joints(path: Path, samples: int) -> int:
    """Two joints at 2 kHz, one sample a message."""
    types = STORE.types
    stamp, values = types["builtin_interfaces/msg/Time"], np.random.default_rng(0).normal(size=2)
    with BagWriter(path, "mcap" if "mcap" in path.name else "sqlite3") as writer:
        for index in range(samples):
            now = 10**18 + index * 10**9 // RATE
            header = types["std_msgs/msg/Header"](stamp=stamp(sec=now // 10**9, nanosec=now % 10**9), frame_id="")
            message = types[JOINT_TYPE](header=header, name=["x", "y"], position=values, velocity=values, effort=values)
            writer.write_raw("/joint_states", JOINT_TYPE, bytes(STORE.serialize_cdr(message, JOINT_TYPE)), now)
    return samples


def loop(path: Path) -> None:
    """The yardstick: each message deserialized by rosbags, its numbers taken."""
    with Reader(path) as reader:
        for connection, _, raw in reader.messages():
            message = STORE.deserialize_cdr(raw, connection.msgtype)
            _ = getattr(message, "data", None)


def stream(path: Path) -> None:
    """Every sample as blocks, in log order."""
    for _ in stream_blocks(path):
        pass


def best(work: Callable[[Path], object], path: Path, repeats: int = REPEATS) -> float:
    """Shortest of some runs, s; the first one compiles and is not counted."""
    times = []
    for _ in range(repeats + 1):
        begin = time.perf_counter()
        work(path)
        times.append(time.perf_counter() - begin)
    return min(times[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=5.0, help="length of the recording")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    samples = int(options.minutes * 60 * RATE) // ROWS * ROWS
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, write in (
            ("blocks of 20, sqlite3", write_blocks),
            ("blocks of 20, mcap", write_blocks),
            ("joint states, sqlite3", write_joints),
            ("joint states, mcap", write_joints),
        ):
            path = Path(folder) / name.replace(" ", "_").replace(",", "")
            count = write(path, samples)
            slow, fast, whole = best(loop, path, 1), best(stream, path, 5), best(load, path)
            rows.append({"bag": name, "samples": count, "loop": count / slow, "stream": count / fast, "load": count / whole, "ratio": slow / fast})
            print(f"  {name} measured", file=sys.stderr)
    one_by_one = next(float(str(row["loop"])) for row in rows if row["bag"] == "joint states, sqlite3")
    if options.json:
        print(json.dumps({"minutes": options.minutes, "rows": rows}))
        return
    print(f"{options.minutes:g} min at {RATE} Hz, 2 axes; million samples a second\n")
    print(f"{'bag':24}{'loop':>8}{'stream':>9}{'load':>8}{'stream/loop':>13}{'against a loop over joint states':>35}")
    for row in rows:
        numbers = [float(str(row[key])) for key in ("loop", "stream", "load", "ratio")]
        print(
            f"{row['bag']:24}{numbers[0] / 1e6:8.2f}{numbers[1] / 1e6:9.2f}{numbers[2] / 1e6:8.2f}{numbers[3]:12.1f}x{numbers[1] / one_by_one:34.0f}x"
        )


if __name__ == "__main__":
    main()
