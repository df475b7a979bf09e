"""Replay of five minutes of two axes.

The identifier's logic on a bag (20-row blocks, sqlite3), a fit of both axes to all data and to the newest windows
(for the resonance alarm) every 2 s of data, in a process in which everything is compiled.
Times are processor time, user and system, so that other work on the machine does not count.
The orders are chosen from the data at the first fit, which takes a fifth of the time, and judged again at the fits 2, 4, 8 and so on.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from campaigns.bench.tables import Table, at_least
from xy_sim.machine import Machine
from xy_sysid.bags import stream_blocks
from xy_sysid.excitation.lockstep import drive
from xy_sysid.imports import save
from xy_sysid.live.fitter import warm_up
from xy_sysid.live.replay import replay
from xy_sysid.settings import AxisExcitation, ExcitationSettings, IdentifierSettings

SECONDS, BRIEF = 300.0, 10.0
RUNS = 3


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Times real time."""
    seconds = BRIEF if short else SECONDS
    report(f"replay: simulating {seconds:g} s")
    machine = Machine.from_file("paper.yaml")
    axes = {axis: AxisExcitation(seed=1 + k) for k, axis in enumerate(machine.axes)}
    recording = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes=axes), seconds, lambda _: None)
    settings = IdentifierSettings()
    warm_up(settings)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        save(recording, path)
        times = []
        for number in range(1 if short else RUNS):
            begun = time.process_time()
            blocks = ((kind, block) for kind, block in stream_blocks(path) if kind != "reference")
            updates = sum(1 for _ in replay(blocks, settings, machine.axes))
            times.append(time.process_time() - begun)
            rows.append((f"run {number + 1}", f"{times[-1]:.2f}", f"{updates}", f"{seconds / times[-1]:.0f}x"))
    best = sorted(times)[len(times) // 2]
    checks = (at_least("times real time (median of three)", seconds / best, 200.0),)
    return Table("Replay of a bag", __doc__.split("\n\n", 1)[1], ("", "s of one core", "fits", "of real time"), tuple(rows), checks)
