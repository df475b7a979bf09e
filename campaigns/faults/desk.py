"""One scenario on two hosts, run on the desk: python -m campaigns.faults.desk SCENARIO; prints its results as one line of JSON.

The machine's host has the drive (the simulated table in real time, with a watchdog of 50 ms) and the excitation; the desk has the
identifier, and in some scenarios the excitation (with a watchdog of 0.5 s, so that a busy computer does not look like a pulled cable).
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.cable import Hosts
from xy_sysid.cli.monitor import Monitor

MODULES = {"ballscrew": "xy_sim.node", "excitation": "xy_sysid.nodes.excitation", "identifier": "xy_sysid.nodes.identifier"}
LENGTH = 1024  # samples of a window
PARAMETERS: dict[str, dict[str, Any]] = {
    "ballscrew": {"machine": "rigid.yaml", "realtime": True, "watchdog": 0.05},
    "excitation": {"x.rms": 1.0, "y.rms": 1.0, "watchdog": 0.5},
    "identifier": {"length": LENGTH, "numerator_order": 0, "denominator_order": 2, "refit": 2.0, "band_low": 4.0, "save_every": 1.0},
}
READY = 60.0  # s, timeout


class Desk:
    """Starts nodes on either host, and receives messages on this one."""

    def __init__(self, hosts: Hosts, folder: Path, remote_drive: bool = False) -> None:
        self.hosts, self.folder, self.remote = hosts, folder, remote_drive
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.monitor = Monitor(("x", "y"), listeners=1)
        self.begun = time.monotonic()

    def start(self, name: str) -> None:
        """Start a node on its host."""
        parameters = dict(PARAMETERS[name])
        if name == "identifier":
            parameters["state_file"] = str(self.folder / "state.npz")
        pairs = [word for key, value in parameters.items() for word in ("-p", f"{key}:={str(value).lower() if isinstance(value, bool) else value}")]
        at_machine = name == "ballscrew" or (name == "excitation" and not self.remote)
        place = ["ip", "netns", "exec", self.hosts.machine] if at_machine else []
        with (self.folder / f"{name}.log").open("ab") as log:
            command = [*place, sys.executable, "-m", MODULES[name], "--ros-args", "-r", "__ns:=/xy", *pairs]
            self.processes[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def kill(self, name: str) -> None:
        """kill -9 of a node; the process of ip has become the node."""
        self.processes[name].send_signal(signal.SIGKILL)
        self.processes[name].wait()
        if name == "identifier":
            self.monitor.statuses.pop("streams", None)
        self.monitor.statuses.pop(name, None)

    def end(self) -> None:
        """End all nodes."""
        for process in self.processes.values():
            process.send_signal(signal.SIGINT)
        for process in self.processes.values():
            try:
                process.wait(8)
            except subprocess.TimeoutExpired:
                process.kill()
        self.monitor.close()

    def said(self, name: str) -> str:
        """The output of a node."""
        return (self.folder / f"{name}.log").read_text("utf-8", "replace")

    def until(self, done: Callable[[], bool], seconds: float) -> float:
        """Receive messages until ``done``; returns the time, s, or NaN after ``seconds``."""
        begun = time.monotonic()
        while time.monotonic() - begun < seconds:
            if done():
                return time.monotonic() - begun
            self.monitor.spin(0.02)
        return float("nan")

    def value(self, status: str, key: str) -> float:
        """A number from the status of a node; 0 before the first status."""
        return float(self.monitor.statuses.get(status, (0, "", {}))[2].get(key, "0"))

    def active(self) -> bool:
        """True if the excitation reports that it drives."""
        return str(self.monitor.statuses.get("excitation", (0, "", {}))[2].get("state", "")) == "active"

    def drive(self, seconds: float = READY) -> bool:
        """Configure and activate the excitation once all nodes are connected; True if it drives."""
        from lifecycle_msgs.msg import Transition

        if not self.monitor._wanted:
            self.monitor._wanted = [Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE]
            self.monitor._call = None

        def driven() -> bool:
            call = self.monitor._call
            if call is not None and call.done() and call.result() is not None and not call.result().success and len(self.monitor._wanted) == 2:
                self.monitor._wanted.pop(0)  # it is configured already
            if call is not None and call.done():
                self.monitor._call = None if not (call.result() and call.result().success) else call
            self.monitor.start_when_ready()
            return not self.monitor._wanted and self.active()

        self.until(driven, seconds)
        return self.active()

    def response(self) -> dict[str, list[float]]:
        """The response of axis x: frequency, real, imag, sigma."""
        message = self.monitor.arrays.get("frf/x")
        if message is None:
            return {}
        table = message.data.reshape(-1, 5)
        rows = (table[:, 0] >= 5) & (table[:, 0] <= 200)
        return {name: table[rows, place].tolist() for place, name in ((0, "frequency"), (1, "real"), (2, "imag"), (4, "sigma"))}

    def facts(self) -> dict[str, Any]:
        """The counters of the nodes."""
        streams = self.monitor.statuses.get("streams", (0, "", {}))
        axis = self.monitor.statuses.get("axis x", (0, "", {}))
        return {
            "paired": self.value("streams", "samples paired"),
            "windows": self.value("axis x", "windows"),
            "dropped": self.value("axis x", "dropped windows"),
            "streams": streams[1],
            "reasons": {key.removeprefix("stream: "): int(value) for key, value in streams[2].items() if key.startswith("stream: ") and value != "0"},
            "axis": axis[1],
            "active": self.active(),
            "response": self.response(),
            "tracebacks": [name for name in self.processes if "Traceback" in self.said(name)],
        }


def loss(desk: Desk, part: float, seconds: float) -> dict[str, Any]:
    """All nodes start at once, with the loss ``part`` from the start."""
    desk.hosts.order(loss=part)
    for name in ("ballscrew", "identifier", "excitation"):
        desk.start(name)
    driven = desk.drive()
    first = desk.until(lambda: desk.value("axis x", "windows") > 0, READY)
    stall, last, since = 0.0, 0.0, time.monotonic()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        desk.monitor.spin(0.05)
        now = desk.value("streams", "samples paired")
        if now > last:
            last, since = now, time.monotonic()
        stall = max(stall, time.monotonic() - since)
    return {"driven": driven, "until first window": first, "stall": stall, **desk.facts()}


def pulled(desk: Desk, away: float, seconds: float) -> dict[str, Any]:
    """The cable is pulled during normal operation, and reconnected."""
    loss(desk, 0.0, 6.0)
    before = desk.facts()
    desk.hosts.order(loss=1.0)
    desk.monitor.spin(away)
    silent = desk.facts()
    desk.hosts.order(loss=0.0)
    paired = silent["paired"]
    back = desk.until(lambda: desk.value("streams", "samples paired") > paired, READY)
    again = True
    if desk.remote:  # without positions the drive must have ended
        stopped = "no position from the machine" in desk.said("excitation") or not desk.active()
        again = desk.drive()
        back = desk.until(lambda: desk.value("streams", "samples paired") > paired, READY)
        return {"stopped": stopped, "again": again, "until it goes on": back, **_after(desk, seconds), "windows before": before["windows"]}
    return {"until it goes on": back, **_after(desk, seconds), "windows before": before["windows"]}


def _after(desk: Desk, seconds: float) -> dict[str, Any]:
    desk.monitor.spin(seconds)
    return desk.facts()


def late(desk: Desk, seconds: float) -> dict[str, Any]:
    """The identifier joins 5 s after the machine began to move."""
    desk.start("ballscrew")
    desk.start("excitation")
    desk.monitor.statuses["streams"] = (0, "", {})  # there is no identifier to wait for
    driven = desk.drive()
    desk.monitor.spin(5.0)
    desk.start("identifier")
    begun = time.monotonic()
    first = desk.until(lambda: desk.value("axis x", "windows") > 0, READY)
    return {"driven": driven, "until first window": first, "since": begun - desk.begun, **_after(desk, seconds)}


def _more_paired(desk: Desk, than: float) -> bool:
    return desk.value("streams", "samples paired") > than


def restarts(desk: Desk, order: list[str], seconds: float) -> dict[str, Any]:
    """kill -9 of each node in this order, each restarted after its end was noticed; then identification must continue."""
    loss(desk, 0.0, 5.0)
    waits = {}
    for name in order:
        desk.kill(name)
        desk.monitor.spin(1.0)
        desk.start(name)
        paired = desk.value("streams", "samples paired")
        begun = time.monotonic()
        if name == "identifier":
            paired = 0.0
        if not desk.active() or name in ("excitation", "ballscrew"):
            desk.drive()
        desk.until(partial(_more_paired, desk, paired), READY)
        waits[name] = time.monotonic() - begun
    return {"waits": waits, "until it goes on": max(waits.values()), **_after(desk, seconds)}


def clocks(desk: Desk, seconds: float) -> dict[str, Any]:
    """A source on the machine's host whose clock jumps forward by an hour, back by a day and by 50 ms, and whose rate then changes."""
    desk.start("identifier")
    place = ["ip", "netns", "exec", desk.hosts.machine]
    with (desk.folder / "source.log").open("ab") as log:
        desk.processes["source"] = subprocess.Popen(
            [*place, sys.executable, "-m", "campaigns.faults.source"], stdin=subprocess.DEVNULL, stdout=log, stderr=log
        )
    first = desk.until(lambda: desk.value("axis x", "windows") > 0, READY)
    ended = desk.until(lambda: desk.processes["source"].poll() is not None, READY)
    desk.monitor.spin(2.0)
    return {"until first window": first, "ended": ended, **desk.facts(), "identifier": desk.said("identifier")[-2000:]}


def main(asked: dict[str, Any]) -> dict[str, Any]:
    """Run the requested scenario; returns its results."""
    hosts = Hosts(**asked["hosts"])
    folder = Path(asked["folder"])
    desk = Desk(hosts, folder, bool(asked.get("remote")))
    scenarios: dict[str, Callable[..., dict[str, Any]]] = {"loss": loss, "pulled": pulled, "late": late, "restarts": restarts, "clocks": clocks}
    try:
        return scenarios[asked["scenario"]](desk, *asked.get("arguments", []))
    finally:
        desk.end()


def plain(value: Any) -> Any:
    """The value in JSON types: NaN becomes null."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


if __name__ == "__main__":
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
    sys.stdout.write(json.dumps(plain(main(json.loads(sys.argv[1])))) + "\n")
