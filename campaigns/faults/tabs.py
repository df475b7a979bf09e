"""The page under load: fifty tabs, clients that read nothing, a lost WebSocket, a killed server; with STOP during each."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found, environment
from campaigns.faults.door import frame, upgrade
from campaigns.faults.soak import NODES, memory
from xy_sysid.samples.block import Block

WORDS = (
    "The live page with all nodes over DDS, and a machine that is driven. STOP is requested with POST /stop. It counts when the server reports "
    "that the machine has confirmed it and the last received voltage is zero. Longest: from STOP to that answer."
)
CHROMIUM = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
STOPS = 3.0  # s
DRAWN = 600.0  # s, limit until all fifty tabs are drawn, which share the processors of one computer
MORE = 60.0  # MB


def _why_not() -> str:
    if importlib.util.find_spec("rclpy") is None:
        return "ROS 2 is not installed"
    if CHROMIUM is None or importlib.util.find_spec("playwright") is None:
        return "no Chromium, or no playwright"
    return ""


@dataclass
class Scene:
    """Nodes, a page's server, and a subscriber of the voltage."""

    folder: Path
    monitor: Any
    address: str = ""
    voltage: list[Block] = field(default_factory=list)
    processes: dict[str, Any] = field(default_factory=dict)

    def start(self, name: str, *words: str) -> None:
        """Start one process."""
        with (self.folder / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen([sys.executable, *words], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment())

    def serve(self, port: int = 0) -> None:
        """Start the page's server; its address is in its first line of output."""
        begun = len(self.said("page"))
        self.start("page", "-m", "xy_sysid", "page", "--port", str(port), "--no-browse", "--folder", str(self.folder))
        assert self.until(lambda: "http://" in self.said("page")[begun:], 180.0), self.said("page")
        self.address = self.said("page")[begun:].partition("http://")[2].partition("\n")[0].strip()
        self.address = f"http://{self.address}"

    def said(self, name: str) -> str:
        """The output of a process."""
        path = self.folder / f"{name}.log"
        return path.read_text("utf-8", "replace") if path.exists() else ""

    def until(self, done: Callable[[], bool], seconds: float) -> bool:
        """Receive messages until ``done``; False after ``seconds``."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if done():
                return True
            self.monitor.spin(0.02)
        return done()

    def drive(self) -> None:
        """Release STOP, then configure and activate, with the page's own ROS calls."""
        from lifecycle_msgs.msg import Transition
        from std_srvs.srv import Trigger

        release = self.monitor._node.create_client(Trigger, "excitation/release_stop")
        assert self.until(release.service_is_ready, 60.0), self.said("excitation")
        for _ in range(2):  # the first call lists the nodes that hold STOP
            answer = release.call_async(Trigger.Request())
            assert self.until(answer.done, 30.0), self.said("excitation")
        self.monitor._wanted = [Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE]

        def moving() -> bool:
            call = self.monitor._call
            if call is not None and call.done() and call.result() is not None and not call.result().success:
                self.monitor._wanted, self.monitor._call = [Transition.TRANSITION_ACTIVATE], None
            self.monitor.start_when_ready()
            return bool(self.voltage) and bool(self.voltage[-1].values.any())

        assert self.until(moving, 150.0), (self.said("excitation"), self.monitor.statuses)
        self.monitor._node.destroy_client(release)

    def stop(self, what: str) -> Found:
        """POST /stop, and its outcome."""
        begun = time.monotonic()
        asked = urllib.request.Request(f"{self.address.rstrip('/')}/stop", method="POST", headers={"X-Requested-With": "xy_sysid"})
        try:
            with urllib.request.urlopen(asked, timeout=20.0) as answer:
                told = json.load(answer)
        except OSError as problem:
            return Found("too late", note=f"{what}: {problem}")
        seconds = time.monotonic() - begun
        self.monitor.spin(0.3)
        zero = bool(self.voltage) and not self.voltage[-1].values.any()
        good = told["stopped"] and zero and seconds < STOPS
        return Found("zero volts" if good else "too late", seconds, note="" if good else f"{what}: {told}, {seconds:.1f} s, zero {zero}")


@contextmanager
def scene(folder: Path) -> Iterator[Scene]:
    """A scene whose machine is driven."""
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.cli.monitor import Monitor
    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import from_message

    os.environ.update(ROS_DOMAIN_ID=str(os.getpid() % 90 + 10), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    made = Scene(folder, Monitor(("x", "y"), listeners=2))
    made.monitor._node.create_subscription(Float64MultiArray, "voltage", lambda message: made.voltage.append(from_message(message)), DATA_QOS)
    try:
        for name, module in NODES.items():
            extra = ["-p", "watchdog:=2.0"] if name == "excitation" else ["-p", "refit:=0.5"] if name == "identifier" else []
            made.start(name, "-m", module, "--ros-args", "-r", "__ns:=/xy", *extra)
        made.serve()
        made.drive()
        yield made
    finally:
        for process in made.processes.values():
            process.terminate()
        for process in made.processes.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
        made.monitor.close()


@contextmanager
def browser() -> Iterator[Any]:
    """A context of a real browser with low priority, because real tabs would be on other computers."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play, tempfile.TemporaryDirectory(prefix="browser_") as name:
        polite = Path(name) / "chromium"
        polite.write_text(f'#!/bin/sh\nexec nice -n 19 {CHROMIUM} "$@"\n')
        polite.chmod(0o755)
        made = play.chromium.launch(executable_path=polite, args=["--headless", "--no-sandbox", "--disable-gpu"])
        try:
            yield made.new_context()
        finally:
            made.close()


def _tab(made: Any, address: str) -> Any:
    tab = made.new_page()
    tab.goto(address, wait_until="commit", timeout=1000.0 * DRAWN)
    return tab


def _drawn(tab: Any) -> bool:
    return bool(tab.locator("[data-part=nodes]").count())


def _tells(tab: Any) -> bool:
    """True if a tab shows the STOP; False while it reloads the page."""
    from playwright.sync_api import Error

    try:
        return "stopp" in str(tab.content()).lower()
    except Error:
        return False


def fifty(count: int, folder: Path) -> Iterator[Found]:
    """Fifty tabs, all drawn; STOP; memory and descriptors after they are closed."""
    with scene(folder) as here, browser() as made:
        before = memory(here.processes["page"].pid)
        begun = time.monotonic()
        tabs = [_tab(made, here.address) for _ in range(50)]
        end, drawn = time.monotonic() + DRAWN, 0
        while time.monotonic() < end and (drawn := sum(_drawn(tab) for tab in tabs)) < 50:
            tabs[0].wait_for_timeout(500)
            here.monitor.spin(0.1)
        seconds = time.monotonic() - begun
        full = memory(here.processes["page"].pid)
        found = here.stop("with fifty tabs")
        here.until(lambda: all(_tells(tab) for tab in tabs), 60.0)
        told = sum(_tells(tab) for tab in tabs)
        for tab in tabs:
            tab.close()
        here.until(lambda: memory(here.processes["page"].pid)[1] <= before[1] + 5, 90.0)
        after = memory(here.processes["page"].pid)
        note = f"{drawn} of 50 drawn within {seconds:.0f} s; MB and descriptors of the server: {before[0]:.0f} and {before[1]} before, "
        note += f"{full[0]:.0f} and {full[1]} with them, {after[0]:.0f} and {after[1]} after; {told} tabs show the STOP"
        good = found.outcome == "zero volts" and drawn == 50 and told == 50 and after[1] <= before[1] + 5 and "Traceback" not in here.said("page")
        yield Found("zero volts" if good else "too late", found.seconds, note=note if good else f"{note}; {found.note} {here.said('page')[-300:]}")


def stalled(count: int, folder: Path) -> Iterator[Found]:
    """Ten clients that open a WebSocket and then read nothing."""
    with scene(folder) as here, browser() as made:
        port = int(here.address.rstrip("/").rpartition(":")[2])
        tab = _tab(made, here.address)
        here.until(lambda: _drawn(tab), 60.0)
        before = memory(here.processes["page"].pid)[0]
        lines = [upgrade(port) for _ in range(10)]
        for line in lines:
            with suppress(OSError):
                line.sendall(frame(b"40"))
        here.monitor.spin(20.0)
        grown = memory(here.processes["page"].pid)[0] - before
        found = here.stop("with stalled clients")
        for line in lines:
            line.close()
        good = found.outcome == "zero volts" and grown < MORE
        note = f"the server grew by {grown:.0f} MB in 20 s"
        yield Found("zero volts" if good else "too late", found.seconds, note=note if good else f"{note}; {found.note}")


def lost_socket(count: int, folder: Path) -> Iterator[Found]:
    """STOP is pressed in a tab that has lost its WebSocket, during a fit."""
    with scene(folder) as here, browser() as made:
        tab = _tab(made, here.address)
        tab.wait_for_selector("#stop", timeout=1000.0 * DRAWN)
        for number in range(count):
            if number:
                here.drive()
            tab.evaluate("window.socket && window.socket.disconnect()")
            begun = time.monotonic()
            tab.evaluate("window.xyStop()")
            zero = here.until(lambda: not here.voltage[-1].values.any(), STOPS)
            seconds = time.monotonic() - begun
            here.monitor.spin(0.3)
            good = zero and not here.voltage[-1].values.any()
            yield Found("zero volts" if good else "too late", seconds, note="" if good else f"try {number}: {here.said('excitation')[-300:]}")
            tab.reload()
            tab.wait_for_selector("#stop", timeout=1000.0 * DRAWN)


def restarted(count: int, folder: Path) -> Iterator[Found]:
    """kill -9 of the server while it drives, and another on the same port: an open tab recovers, by itself or by a reload, and STOP works."""
    with scene(folder) as here, browser() as made:
        tab = _tab(made, here.address)
        tab.wait_for_selector("#stop", timeout=1000.0 * DRAWN)
        port = int(here.address.rstrip("/").rpartition(":")[2])
        sent = len(here.voltage)
        here.processes["page"].send_signal(signal.SIGKILL)
        here.processes["page"].wait()
        here.monitor.spin(1.0)
        goes_on = len(here.voltage) > sent + 10 and bool(np.any(here.voltage[-1].values))
        here.serve(port)
        back = int(here.address.rstrip("/").rpartition(":")[2]) == port
        tab.goto(here.address)
        tab.wait_for_selector("#stop", timeout=1000.0 * DRAWN)
        found = here.stop("after a restart of the server")
        good = goes_on and back and found.outcome == "zero volts"
        yield Found("zero volts" if good else "too late", found.seconds, note="" if good else f"drives on {goes_on}, same port {back}; {found.note}")


def killed_nodes(count: int, folder: Path) -> Iterator[Found]:
    """kill -9 of the identifier and of the machine while a tab is open: it names the lost node, and STOP works."""
    with scene(folder) as here, browser() as made:
        tab = _tab(made, here.address)
        tab.wait_for_selector("#stop", timeout=1000.0 * DRAWN)
        here.processes["identifier"].send_signal(signal.SIGKILL)
        begun = time.monotonic()
        lost, words = False, ""
        while time.monotonic() - begun < 20.0 and not lost:
            here.monitor.spin(0.2)
            words = str(tab.locator("[data-part=nodes]").first.text_content())
            lost = "lost" in words or "does not answer" in words
        told = time.monotonic() - begun
        found = here.stop("with a dead identifier")
        good = lost and found.outcome == "zero volts"
        note = f"the tab says after {told:.0f} s that the identifier does not answer"
        yield Found("zero volts" if good else "not told", found.seconds, note=note if good else f"{words!r}; {found.note}")


def _needed(work: Callable[[int, Path], Iterator[Found]]) -> Callable[[int, Path], Iterator[Found]]:
    def tries(count: int, folder: Path) -> Iterator[Found]:
        if _why_not():
            yield Found("skipped", note=_why_not())
            return
        yield from work(count, folder)

    return tries


ATTACKS = (
    Attack("fifty tabs", _needed(fifty), 1, 0, "3 s"),
    Attack("ten stalled clients", _needed(stalled), 1, 0, "3 s, 60 MB"),
    Attack("STOP with a lost WebSocket, while fits run", _needed(lost_socket), 3, 0, "3 s"),
    Attack("kill -9 of the server, and another", _needed(restarted), 1, 0, "3 s"),
    Attack("kill -9 of the identifier", _needed(killed_nodes), 1, 0, "3 s"),
)
