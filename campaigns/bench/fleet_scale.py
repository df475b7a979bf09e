"""python -m campaigns.bench fleet_scale: 1,000 short recordings through the fleet's engine, and a few of 60 s in this process.

The 1,000 show what the engine costs a task, and whether a process keeps memory: one process does all of them, and its resident memory is looked at
after every 50. The long ones show how far 1,000 recordings of 60 s are from 10 minutes on two cores. All times are processor time, which other
users of the computer disturb less than the clock.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from datetime import timedelta
from pathlib import Path

import numpy as np

from campaigns.bench.fleet import resident, spent
from campaigns.bench.recordings import markdown
from campaigns.bench.workshop import BEGIN, Workshop
from xy_sysid.fleets.engine import Cluster, connected
from xy_sysid.fleets.estimate import Progress
from xy_sysid.fleets.of_file import Task, rows_of_file
from xy_sysid.fleets.of_paths import Analysis, run
from xy_sysid.fleets.row import FirstSets
from xy_sysid.fleets.table import read
from xy_sysid.imports import save

COUNT, SHORT, DIFFERENT = 1_000, 0.15, 20  # recordings, s of each, and how many differ
LONG, LONGS = 60.0, 4  # s, machines: half of them on rock, half on feet
MACHINES = 50  # of which 1,000 recordings are reckoned to be
EVERY = 50  # recordings between two looks at the memory
WARM = 100  # recordings after which a process has loaded and compiled all that it needs
GOAL = 1.2  # s of processor time: 1,000 recordings in 10 minutes on two cores
PARTS = ("reading", "fit", "diagnosis")
Line = tuple[str, str]


def main(short: bool = False) -> None:
    """Print the figures."""
    count = 6 if short else COUNT
    with tempfile.TemporaryDirectory() as place:
        lines = many(Path(place), count, 2 if short else DIFFERENT)
        if not short:
            lines += long_ones(Path(place))
    sys.stdout.write(markdown(("figure", "measured"), lines) + "\n")


def many(folder: Path, count: int, different: int) -> list[Line]:
    """What a task costs besides its own work, and the memory of the process."""
    shop = Workshop(machines=different, recordings=1, seconds=SHORT, faults={})
    for number in range(different):
        first = folder / "recordings" / f"mill-{number:02d}" / f"{BEGIN:%Y-%m-%d}.npz"
        save(shop.recording(number, 0), first)
        for k in range(1, count // different):  # the same samples on other days are other recordings
            os.link(first, first.with_name(f"{BEGIN + timedelta(days=k):%Y-%m-%d}.npz"))
    memory: list[tuple[int, float]] = []
    with connected(Cluster(workers=1)) as client:
        before = spent(client)

        def tell(now: Progress) -> None:
            if now.done and now.done % EVERY == 0:
                memory.append((now.done, max(client.run(resident).values())))
                sys.stderr.write(f"{now.done} recordings, {memory[-1][1]:.0f} MB\n")

        run(folder / "recordings", folder / "table", Analysis(), client, tell)
        total = spent(client) - before
    rows = read(folder / "table").to_pylist()
    own = sum(row[f"seconds_{part}"] or 0.0 for row in rows for part in PARTS)
    failed = sum(row["verdict"] in (None, "not_enough_data") for row in rows)
    lines = [
        (f"recordings of {SHORT:g} s that are rows of the table; of these without a diagnosis", f"{len(rows)}; {failed}"),
        ("processor time of one, reading, fit and diagnosis", f"{1e3 * own / len(rows):.0f} ms"),
        ("processor time of everything else for one, start of the process included", f"{1e3 * (total - own) / len(rows):.0f} ms"),
    ]
    late = np.array([one for one in memory if one[0] >= WARM])
    if late.shape[0] > 2:
        slope = float(np.polyfit(late[:, 0], late[:, 1], 1)[0])
        ends = f"{late[0, 1]:.0f} MB after {late[0, 0]:.0f}, {late[-1, 1]:.0f} MB after {late[-1, 0]:.0f} recordings"
        lines.append(("memory of the process", f"{ends}: {1e3 * slope:+.0f} kB for each recording"))
    return lines


def long_ones(folder: Path) -> list[Line]:
    """Processor time of a recording of 60 s by its parts: of the first of a machine, and of those after it."""
    shop = Workshop(machines=LONGS, recordings=2, seconds=LONG, faults={})
    costs: tuple[list[tuple[float, ...]], ...] = ([], [])
    for number in (0, LONGS - 1, *range(LONGS)):  # the first two compile
        first: FirstSets = ()
        for k, own in enumerate(costs):
            path = folder / f"long_{number}" / f"2025-0{1 + 6 * k}-06.npz"
            save(shop.recording(number, k), path)
            begun = time.process_time()
            row = rows_of_file(Task(str(path), first=first)).rows[0]
            own.append((*(float(row[f"seconds_{part}"]) for part in PARTS), time.process_time() - begun))
            first = (("x", tuple(row["effects"].split(", "))),)
    costs = tuple(own[2:] for own in costs)
    lines, cost = [], []
    for name, own in zip(("first", "later"), costs, strict=True):
        means = np.mean(own, axis=0)
        each = ", ".join(f"{part} {1e3 * seconds:.0f} ms" for part, seconds in zip(PARTS, means, strict=False))
        cost.append(float(means[-1]))
        lines.append((f"processor time of a {name} recording of {LONG:g} s of an axis", f"{cost[-1]:.1f} s ({each})"))
    mean = (MACHINES * cost[0] + (COUNT - MACHINES) * cost[1]) / COUNT
    minutes = COUNT * mean / 2.0 / 60.0
    told = f"{minutes:.0f} min; goal: 10 min, which is {GOAL:g} s each"
    return [*lines, (f"{COUNT} of them, of {MACHINES} machines, on two cores", told)]


if __name__ == "__main__":
    main()
