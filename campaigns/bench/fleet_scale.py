"""python -m campaigns.bench fleet_scale: 1,000 short recordings through the fleet's engine, and 1,000 of 60 s.

The short ones show the overhead of the engine per task, and whether a process leaks memory: one process does all of them, and its resident memory is
read after every 50. Those of 60 s, 25 of each of 40 machines, are a run of the full command on two processes, by the clock and by the processor time
of all processes. 100 of them are different; the others are the same samples on other machines, and are read and analysed like all.
With a folder in $XY_SYSID_FLEET_LONG the recordings of 60 s are kept there and reused.
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
from xy_sysid.fleets.of_paths import Analysis, run
from xy_sysid.fleets.table import read
from xy_sysid.imports import save

COUNT, SHORT, DIFFERENT = 1_000, 0.15, 20  # recordings, s of each, and number of different ones
LONG = Workshop(machines=4, recordings=25, seconds=60.0, faults={})  # half on rigid foundations, half on feet
COPIES = 10  # machines with the recordings of each of these
EVERY = 50  # recordings between two readings of the memory
WARM = 100  # recordings after which a process has loaded and compiled all its code
GOAL = 10.0  # minutes for 1,000 recordings of 60 s on two cores
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
    """Overhead of a task, and memory of the process."""
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


def long_ones(folder: Path, shop: Workshop = LONG) -> list[Line]:
    """A run of recordings of 60 s with the engine, and its parts: first recordings of the machines, and the others."""
    place = Path(os.environ.get("XY_SYSID_FLEET_LONG", "") or folder / "long")
    made = list(shop.made(place))
    paths = made + [linked(one, copy, folder) for copy in range(1, COPIES) for one in made]
    with connected(Cluster(workers=2)) as client:
        run(made[:: shop.recordings], folder / "warm", Analysis(), client)  # warm-up
        before, begun = spent(client), time.perf_counter()
        run(paths, folder / "long table", Analysis(), client, lambda now: print(now.sentence(), file=sys.stderr))
        total, clock = spent(client) - before, time.perf_counter() - begun
    rows = read(folder / "long table").to_pylist()
    lines = []
    for name, own in (("first", [row for row in rows if not row["tried_first"]]), ("later", [row for row in rows if row["tried_first"]])):
        each = {part: float(np.mean([row[f"seconds_{part}"] for row in own])) for part in PARTS}
        told = ", ".join(f"{part} {1e3 * seconds:.0f} ms" for part, seconds in each.items())
        lines.append((f"{len(own)} recordings of {shop.seconds:g} s, {name} of their axis", f"{sum(each.values()):.2f} s each ({told})"))
    wrong = sum(set(row["effects"].split(", ")) != truth(row["machine"]) for row in rows)
    return [
        *lines,
        ("processor time for each, engine included", f"{total / len(paths):.2f} s"),
        (f"{len(paths)} of them on two processes, by the clock; goal", f"{clock / 60.0:.1f} min; {GOAL:g} min"),
        ("of these with other effects than the simulated ones", f"{wrong}"),
    ]


def linked(recording: Path, copy: int, folder: Path) -> Path:
    """The recording as one of another machine."""
    path = folder / "copies" / f"{recording.parent.name}-{copy}" / recording.name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.symlink_to(recording)
    return path


def truth(machine: str) -> set[str]:
    """The effects that ``Workshop`` gives a machine."""
    on_feet = int(machine.split("-")[1]) > LONG.machines // 2
    return {"coulomb_friction", "base_resonance"} if on_feet else {"coulomb_friction"}


if __name__ == "__main__":
    main()
