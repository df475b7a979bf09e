"""The nodes over real DDS: processor load of each in real time, and the highest speed without lost samples.

Machine, excitation and identifier as processes of their own on this machine, two axes at 2 kHz in blocks of 20, fits every
2 s; processor time from /proc once the windows are full, so that the fits are in it. For the highest speed the excitation
runs in lockstep as fast as it goes: every sample sent must be paired.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from campaigns.bench.tables import Table, at_least, at_most

if TYPE_CHECKING:
    from xy_sysid.cli.monitor import Monitor

NODES = {"excitation": "xy_sysid.nodes.excitation", "identifier": "xy_sysid.nodes.identifier", "ballscrew": "xy_sim.node"}
RATE, WATCHED, FAST = 2000.0, 20.0, 300.0  # Hz; s of real time; s of data as fast as it goes


@contextmanager
def nodes(excitation: dict[str, str]) -> Iterator[tuple[Monitor, dict[str, subprocess.Popen[bytes]]]]:
    """A monitor and the processes, in a separate domain; all are ended at exit."""
    domain = str(os.getpid() % 90 + 10)
    os.environ.update(ROS_DOMAIN_ID=domain, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    from xy_sysid.cli.monitor import Monitor

    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (str(Path.cwd()), os.environ.get("PYTHONPATH"))))}
    started: dict[str, subprocess.Popen[bytes]] = {}
    with tempfile.TemporaryFile() as log:
        monitor = Monitor(("x", "y"), listeners=2)  # no diagnoser here
        try:
            for name in ("ballscrew", "identifier", "excitation"):
                pairs = excitation.items() if name == "excitation" else ()
                words = [word for key, text in pairs for word in ("-p", f"{key}:={text}")]
                command = [sys.executable, "-m", NODES[name], "--ros-args", *words]
                started[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment)
            yield monitor, started
        finally:
            for process in started.values():
                process.terminate()
            for process in started.values():
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    process.kill()
            monitor.close()


def until(monitor: Monitor, done: Callable[[], bool], seconds: float, what: str) -> None:
    """Receive messages until ``done``; SystemExit after ``seconds``."""
    end = time.monotonic() + seconds
    while not done():
        if time.monotonic() > end:
            raise SystemExit(f"bench live: {what} did not come within {seconds:g} s: {monitor.statuses}")
        monitor.start_when_ready()
        monitor.spin(0.02)


def value(monitor: Monitor, status: str, key: str) -> float:
    """A number from the status of a node; 0 before the first status."""
    return float(monitor.statuses.get(status, (0, "", {}))[2].get(key, "0"))


def processor(process: subprocess.Popen[bytes]) -> float:
    """Seconds of processor time so far, all threads."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def real_time(watched: float, windows: int) -> dict[str, float]:
    """Load of each node in per cent of a core, over ``watched`` seconds after the first windows."""
    with nodes({"speed": "1.0", "lockstep": "false", "watchdog": "2.0"}) as (monitor, started):
        until(monitor, lambda: value(monitor, "axis x", "windows") >= windows, 180.0, "the first windows")
        before, begun = {name: processor(process) for name, process in started.items()}, time.monotonic()
        while time.monotonic() - begun < watched:
            monitor.spin(0.5)
        wall = time.monotonic() - begun
        return {name: 100.0 * (processor(process) - before[name]) / wall for name, process in started.items()}


def as_fast_as_it_goes(fast: float) -> tuple[float, int, int, dict[str, str]]:
    """(times real time, samples sent, samples paired, faults that the identifier reports)."""
    with nodes({"speed": "0.0", "lockstep": "true", "duration": str(fast)}) as (monitor, _):
        until(monitor, lambda: value(monitor, "streams", "samples paired") > 0, 180.0, "the first sample")
        first, begun = value(monitor, "streams", "samples paired"), time.monotonic()
        until(monitor, lambda: value(monitor, "streams", "samples paired") >= 0.9 * fast * RATE, 300.0, "nine tenths of the data")
        speed = (value(monitor, "streams", "samples paired") - first) / RATE / (time.monotonic() - begun)
        until(monitor, monitor.over, 120.0, "the end")
        monitor.spin(1.5)
        values = monitor.statuses["streams"][2]
        sent = int(value(monitor, "excitation", "blocks") * 20)
        wrong = {key: text for key, text in values.items() if key.startswith("stream: ") and text != "0"}
        return speed, sent, int(float(values["samples paired"])), wrong


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Both measurements."""
    watched, windows, fast = (1.0, 2, 10.0) if short else (WATCHED, 6, FAST)
    report(f"live: {watched:g} s of real time")
    shares = real_time(watched, windows)
    report(f"live: {fast:g} s of data as fast as they go")
    speed, sent, paired, wrong = as_fast_as_it_goes(fast)
    rows = [(f"{name}, real time", f"{share:.1f} % of a core") for name, share in shares.items()]
    rows += [("lockstep, as fast as it goes", f"{speed:.1f} times real time"), ("samples sent / paired", f"{sent} / {paired}")]
    rows += [("lost, dropped or refused", ", ".join(f"{key} {text}" for key, text in wrong.items()) or "none")]
    checks = (
        at_most("identifier at 2 kHz, 2 axes, real time", shares["identifier"], 5.0, " % of a core"),
        at_least("speed without loss", speed if not wrong and sent == paired else 0.0, 10.0, " x real time"),
    )
    return Table("Live, over DDS", __doc__.split("\n\n", 1)[1], ("what", "measured"), tuple(rows), checks)
