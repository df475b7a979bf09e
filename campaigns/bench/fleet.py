"""python -m campaigns.bench fleet: a year of 20 machines, 200 recordings of 20 s; three develop faults. Does the trend find these three only?

Also: recordings per hour and core, one and two processes, time of reading and computing, and the memory of a process over the run.
With a folder in $XY_SYSID_FLEET the recordings and the table are kept there and reused.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from campaigns.bench.recordings import markdown
from campaigns.bench.workshop import FAULTS, Workshop
from campaigns.pictures.shots import shoot
from xy_sysid.fleets.engine import Cluster, connected
from xy_sysid.fleets.estimate import Progress
from xy_sysid.fleets.of_paths import Analysis, run
from xy_sysid.fleets.table import read
from xy_sysid.fleets.trends import Trends, trend
from xy_sysid.fleets.words import sentence
from xy_sysid.report.trend_page import overview_figure

if TYPE_CHECKING:
    from distributed import Client

SOME = 24  # recordings in the comparison of one and two processes
FEW = Workshop(machines=2, recordings=2, seconds=4.0, faults={})
DRAWN = ("coulomb_friction_coulomb", "base_resonance_frequency", "gain")
PICTURE = Path(__file__).parents[2] / "docs" / "pictures" / "fleet.png"
DAY = 100_000  # recordings per day, for an extrapolation


def main(short: bool = False) -> None:
    """Print the result and the figures."""
    shop = FEW if short else Workshop()
    kept = os.environ.get("XY_SYSID_FLEET", "")
    with tempfile.TemporaryDirectory() as other:
        folder = Path(kept or other)
        paths = list(shop.made(folder / "recordings"))
        lines = [] if short else speed(paths, folder)
        memory: list[tuple[int, float]] = []
        with connected(Cluster(workers=1 if short else 2)) as client:

            def tell(now: Progress) -> None:
                if now.done % 20 == 0:
                    memory.append((now.done, max(client.run(resident).values())))
                    sys.stderr.write(now.sentence() + "\n")

            now = run(folder / "recordings", folder / "table", Analysis(), client, tell)
        rows = read(folder / "table").to_pylist()
        lines += costs(rows)
        if len(memory) > 2 and now.analysed == now.total:
            lines.append(("memory of a process, after 20 and after all recordings", f"{memory[1][1]:.0f} and {memory[-1][1]:.0f} MB"))
        sys.stdout.write(markdown(("figure", "measured"), lines) + "\n\n")
        if short:
            return
        found = trend(folder / "table")
        sys.stdout.write(verdict(found))
        picture(found)


def resident() -> float:
    """Resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def speed(paths: list[Path], folder: Path) -> list[tuple[str, str]]:
    """One and two processes with the same recordings, after one recording each to warm up: elapsed time, and processor time of all processes.

    On a shared computer only processor time is meaningful: elapsed time depends on other users.
    """
    rates, costs = {}, {}
    chosen = [path for begin in (0, len(paths) // 2) for path in paths[begin : begin + SOME // 2]]  # half on rigid foundations, half on feet
    for workers in (1, 2):
        with connected(Cluster(workers=workers)) as client, tempfile.TemporaryDirectory(dir=folder) as place:
            run(paths[:workers], Path(place) / "first", Analysis(), client)
            before = spent(client)
            rates[workers] = run(chosen, Path(place) / "table", Analysis(), client).rate
            costs[workers] = (spent(client) - before) / len(chosen)
        sys.stderr.write(f"{workers}: {rates[workers]:.0f} recordings an hour, {costs[workers]:.2f} s of processor time each\n")
    lines = [(f"recordings an hour on {count} process{'es' * (count > 1)}, by the clock", f"{rate:.0f}") for count, rate in rates.items()]
    lines += [(f"processor time of a recording on {count}, engine included", f"{1e3 * cost:.0f} ms") for count, cost in costs.items()]
    lines.append(("efficiency of two processes by the clock", f"{rates[2] / (2.0 * rates[1]):.2f}"))
    return [*lines, ("efficiency of two processes by processor time", f"{costs[1] / costs[2]:.2f}")]


def spent(client: Client) -> float:
    """Processor time of a cluster's processes so far, s, including this one, in which the scheduler runs."""
    return time.process_time() + float(sum(client.run(time.process_time).values()))


def costs(rows: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Processor time of a recording by parts, and the need of a large fleet."""
    parts = {name: float(np.mean([row[f"seconds_{name}"] or 0.0 for row in rows])) for name in ("reading", "fit", "diagnosis")}
    each = sum(parts.values())
    lines = [(f"processor time for {name}, mean", f"{1e3 * seconds:.0f} ms") for name, seconds in parts.items()]
    lines.append(("recordings an hour and core, of the processor time", f"{3600.0 / each:.0f}"))
    return [*lines, (f"cores for {DAY} such recordings a day, on paper", f"{math.ceil(DAY * each / 86400.0)}")]


def picture(found: Trends) -> None:
    """Draw docs/pictures/fleet.png: the parameters that change on the three machines, for all machines."""
    figures = [overview_figure([one for one in found.trends if one.history.column == column], column) for column in DRAWN]
    shoot(figures, PICTURE, 380, 300)


def verdict(found: Trends) -> str:
    """The result of the trend, and whether it is correct: only the faulty machines, each with its cause."""
    axes = {(one.machine, one.axis): one for one in found.axes}
    said = "\n".join(f"- {sentence(event, axes[event.machine, event.axis])}" for event in found.events)
    named: dict[str, set[str]] = {}
    for event in found.events:
        named.setdefault(event.machine, set()).add(event.cause.cause if event.cause is not None else "")
    right = sum(fault.name in named.get(machine, set()) for machine, fault in FAULTS.items())
    others = sorted(set(named) - set(FAULTS))
    found_text = f"Machines that go bad and are found with their cause: {right} of {len(FAULTS)}."
    return f"{said}\n\n{found_text} Others that are named: {', '.join(others) or 'none'}.\n"


if __name__ == "__main__":
    main()
