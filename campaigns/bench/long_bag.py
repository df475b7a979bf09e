"""A recording of hours is streamed in linear time and with constant memory.

    python -m campaigns.bench.long_bag [--hours 0.0417 1 4] [--storage sqlite3] [--rows 20] [--json]

Two axes at 2 kHz. A bag is written in bulk, streamed by a separate process, whose peak memory is measured, and deleted.
24 hours (--hours 24) need 16 GB of disk.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from xy_sysid.bags import BagWriter
from xy_sysid.bags.cdr import ARRAY_TYPE, encode_array
from xy_sysid.samples.block import Block, columns, pack

RATE = 2000
ALLOWED = 400.0  # MB, highest peak memory
BRIEF = ("--hours", "0.002", "0.004")

READ = """
import json, resource, sys, time
from xy_sysid.bags import stream_blocks
next(iter(stream_blocks(sys.argv[2])))  # compiles
begin, counts, last, right = time.perf_counter(), {}, {}, True
for kind, block in stream_blocks(sys.argv[1]):
    right &= block.seq[0] == last.get(kind, -1) + 1
    last[kind] = block.seq[-1]
    counts[kind] = counts.get(kind, 0) + len(block)
print(json.dumps({"seconds": time.perf_counter() - begin, "samples": counts, "right": bool(right),
                  "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}))
"""


def write(path: Path, storage: str, samples: int, rows: int) -> None:
    """Write voltage and position in blocks; only counter and time change from block to block, so that writing is fast."""
    values = np.random.default_rng(0).normal(size=(rows, 2))
    label = ("sample", columns(("x", "y")))
    message = encode_array(label, (rows, 4), pack(Block(("x", "y"), np.arange(float(rows)), np.arange(float(rows)) / RATE, values)))
    head, table = message[: -32 * rows], np.frombuffer(message[-32 * rows :], "<f8").reshape(rows, 4).copy()
    with BagWriter(path, "mcap" if storage == "mcap" else "sqlite3") as writer:
        for first in range(0, samples, rows):
            table[:, 0] = np.arange(first, first + rows)
            table[:, 1] = table[:, 0] / RATE
            raw = head + table.tobytes()
            for topic in ("/xy/voltage", "/xy/position"):
                writer.write_raw(topic, ARRAY_TYPE, raw, int(first * 1e9 / RATE))


def measure(folder: Path, storage: str, hours: float, rows: int) -> dict[str, float]:
    """Write, stream and delete a bag; returns sizes, times and peak memory."""
    samples = int(hours * 3600 * RATE) // rows * rows
    path, small = folder / "long", folder / "small"
    begin = time.perf_counter()
    write(path, storage, samples, rows)
    writing = time.perf_counter() - begin
    if not small.exists():
        write(small, storage, 40 * rows, rows)
    size = sum(item.stat().st_size for item in path.iterdir()) / 1e9
    done = subprocess.run([sys.executable, "-c", READ, str(path), str(small)], check=True, capture_output=True, text=True)
    answer = json.loads(done.stdout)
    shutil.rmtree(path)
    if answer["samples"] != {"voltage": samples, "position": samples} or not answer["right"]:
        raise SystemExit(f"wrong samples: {answer}")
    return {"hours": hours, "gigabytes": size, "written": writing, "seconds": answer["seconds"], "peak": answer["peak"]}


def main(short: bool = False) -> None:
    """Print the results; SystemExit for more memory than allowed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, nargs="+", default=[1 / 24, 1.0, 4.0])
    parser.add_argument("--storage", choices=("sqlite3", "mcap"), default="sqlite3")
    parser.add_argument("--rows", type=int, default=20, help="samples in one message")
    parser.add_argument("--folder", type=Path, default=None, help="where the bag is written for a while")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(BRIEF if short else None)
    results = []
    if not options.json:
        print(
            f"{options.storage}, {options.rows} rows a message\n{'hours':>7}{'GB':>8}{'write s':>9}{'stream s':>10}{'s per hour':>12}{'peak MB':>9}"
        )
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        for hours in options.hours:
            row = measure(Path(folder), options.storage, hours, options.rows)
            results.append(row)
            if not options.json:
                print(
                    f"{hours:7.3f}{row['gigabytes']:8.2f}{row['written']:9.1f}{row['seconds']:10.2f}{row['seconds'] / hours:12.2f}{row['peak']:9.0f}",
                    flush=True,
                )
    if options.json:
        print(json.dumps({"storage": options.storage, "rows": options.rows, "results": results}))
    if max(row["peak"] for row in results) > ALLOWED:
        raise SystemExit(f"more than {ALLOWED:.0f} MB")


if __name__ == "__main__":
    main()
