"""What the nodes cost, and how fast they can go.

The machine, the identifier and the excitation as processes over DDS on this computer. First in real time, 2 axes at 2 kHz in blocks of 20:
processor time of each node over its own life after start, from /proc. Then in lockstep as fast as it goes: seconds of data over seconds
of clock, and whether a sample was lost.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from bench.tables import Check, Table, at_least, at_most

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

NODES = {"ballscrew": "xy_sim.node", "identifier": "xy_sysid.nodes.identifier", "excitation": "xy_sysid.nodes.excitation"}
REAL_TIME, FAST = 20.0, 60.0  # s of data


def cpu_seconds(pid: int) -> float:
    """Processor time of a process so far, s."""
    parts = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(parts[11]) + int(parts[12])) / os.sysconf("SC_CLK_TCK")


def watched(parameters: dict[str, object], seconds: float) -> tuple[dict[str, float], float, dict[str, str]]:
    """(cpu seconds of each node, seconds by the clock, the identifier's last words about the streams)."""
    from ros_tools import world_in

    with tempfile.TemporaryDirectory() as folder, world_in(Path(folder)) as world:
        statuses = world.statuses()
        nodes = {name: world.start(module, parameters if name == "excitation" else {}) for name, module in NODES.items()}

        def last(name: str) -> dict[str, str]:
            for status in reversed(statuses):
                if status.name == name:
                    return {pair.key: pair.value for pair in status.values}
            return {}

        def ready() -> bool:
            return "samples paired" in last("streams") and all(int(last(n).get("listeners", "0")) >= 2 for n in ("excitation", "ballscrew"))

        assert world.until(ready, 60.0), "the nodes did not come up"
        assert world.transition("excitation", "configure")
        before = {name: cpu_seconds(node.process.pid) for name, node in nodes.items()}
        begun = time.monotonic()
        assert world.transition("excitation", "activate")
        assert world.until(lambda: last("excitation").get("state") == "stopped", 10 * seconds)
        clock = time.monotonic() - begun
        spent = {name: cpu_seconds(node.process.pid) - before[name] for name, node in nodes.items()}
        world.spin(2.5)
        return spent, clock, last("streams")


def run(report: Callable[[str], None]) -> Table:
    """Per cent of a core of each node, and the highest speed without loss."""
    report("live: 20 s in real time")
    slow, clock, _ = watched({"duration": REAL_TIME}, REAL_TIME)
    report("live: as fast as it goes")
    fast, fast_clock, streams = watched({"duration": FAST, "lockstep": True, "speed": 0.0}, FAST)
    lost = sum(int(value) for key, value in streams.items() if key.startswith("stream: ")) + int(streams["skipped fits"])
    paired = int(streams["samples paired"])
    speed = paired / 2000.0 / fast_clock
    rows = tuple((name, f"{100 * slow[name] / clock:.1f} %", f"{100 * fast[name] / fast_clock:.1f} %") for name in NODES)
    checks = (
        at_most("identifier in real time, per cent of a core", 100 * slow["identifier"] / clock, 5.0, " %"),
        at_least("times real time in lockstep", speed, 10.0),
        Check("samples lost or fits skipped at that speed", f"{lost} of {paired}", "0", lost == 0),
    )
    return Table("Live nodes", __doc__.split("\n\n", 1)[1], ("node", "of a core, real time", "of a core, as fast as it goes"), rows, checks)
