"""python -m campaigns.faults soak [--hours 24] [--speed max|X] [--block N] [--minutes M]: a day of data through all nodes and the page.

Machine, excitation, identifier and the page's server (with one open tab), over DDS, at full speed. Growth is the
slope of a straight line through the second half of the measurements, per hour of data. The table is written to docs/faults.md.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import environment

RATE = 2000.0  # Hz
LOOK = 5.0  # s between two readings of the processes
FLAT = 5.0  # MB per hour of data; less counts as constant
PAGE = Path(__file__).parents[2] / "docs" / "faults.md"
NODES = {"ballscrew": "xy_sim.node", "identifier": "xy_sysid.nodes.identifier", "excitation": "xy_sysid.nodes.excitation"}


def memory(process: int) -> tuple[float, int]:
    """(MB resident, open descriptors) of a process."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    resident = next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:"))
    return resident / 1024.0, len(list(Path(f"/proc/{process}/fd").iterdir()))


def _page(folder: Path, surroundings: dict[str, str]) -> tuple[subprocess.Popen[str], str]:
    words = [sys.executable, "-m", "xy_sysid", "page", "--port", "0", "--no-browse", "--folder", str(folder)]
    with (folder / "page.log").open("wb") as log:
        server = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log, text=True, env=surroundings)
    assert server.stdout is not None
    return server, server.stdout.readline().strip()


def _tab(address: str, over: threading.Event) -> None:
    """An open tab until the end; without a browser, repeated requests for the page."""
    import shutil

    program = next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None)
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        program = None
    if program is None:
        while not over.wait(10.0):
            urllib.request.urlopen(address, timeout=30.0).read()
        return
    with sync_playwright() as play:
        made = play.chromium.launch(executable_path=program, args=["--headless", "--no-sandbox", "--disable-gpu"])
        tab = made.new_page()
        tab.goto(address)
        while not over.is_set():
            tab.wait_for_timeout(500)
        made.close()


def measure(hours: float, speed: float, block: int, minutes: float) -> tuple[float, dict[str, list[tuple[float, float, int]]], dict[str, str]]:
    """(h of data, by node (h of data, MB, descriptors) at each reading, values of the identifier's status of streams)."""
    from xy_sysid.cli.monitor import Monitor

    os.environ.update(ROS_DOMAIN_ID=str(os.getpid() % 90 + 10), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    surroundings = environment()
    parameters = {"excitation": {"lockstep": "true", "speed": str(speed), "block": str(block), "duration": str(hours * 3600.0), "patience": "60.0"}}
    looks: dict[str, list[tuple[float, float, int]]] = {}
    with tempfile.TemporaryDirectory(prefix="soak_") as name:
        folder = Path(name)
        server, address = _page(folder, surroundings)
        processes: dict[str, subprocess.Popen[bytes]] = {}
        monitor, over = Monitor(("x", "y"), listeners=2), threading.Event()
        tab = threading.Thread(target=_tab, args=(address, over), daemon=True)
        try:
            for node, module in NODES.items():
                words = [word for key, value in parameters.get(node, {}).items() for word in ("-p", f"{key}:={value}")]
                with (folder / f"{node}.log").open("wb") as log:
                    command = [sys.executable, "-m", module, "--ros-args", "-r", "__ns:=/xy", *words]
                    processes[node] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=surroundings)
            tab.start()
            begun, looked, data = time.monotonic(), 0.0, 0.0
            while time.monotonic() - begun < 60.0 * minutes and data < 0.999 * hours:
                monitor.start_when_ready()
                monitor.spin(0.2)
                data = float(monitor.statuses.get("streams", (0, "", {}))[2].get("samples paired", "0")) / RATE / 3600.0
                if time.monotonic() - looked > LOOK and data > 0:
                    looked = time.monotonic()
                    for node, number in [*((node, process.pid) for node, process in processes.items()), ("page", server.pid)]:
                        looks.setdefault(node, []).append((data, *memory(number)))
            return data, looks, monitor.statuses.get("streams", (0, "", {}))[2]
        finally:
            over.set()
            tab.join(20.0)
            everybody: list[subprocess.Popen[Any]] = [*processes.values(), server]
            for process in everybody:
                process.terminate()
            for process in everybody:
                try:
                    process.wait(15)
                except subprocess.TimeoutExpired:
                    process.kill()
            monitor.close()


Looks = dict[str, list[tuple[float, float, int]]]


def table(data: float, asked: argparse.Namespace, looks: Looks, streams: dict[str, str], minutes: float) -> tuple[str, bool]:
    """The section of the page, and True if no process grows."""
    lines = [
        "## Soak",
        "",
        f"`python -m campaigns.faults soak --block {asked.block}`: {data:.2f} h of data (two axes, 2 kHz) in {minutes:.0f} min "
        f"through simulated machine, excitation and identifier over DDS, with the page and an open tab. "
        f"Measured; the column of {asked.hours:.0f} h extrapolates the slope of the second half.",
        "",
        "| node | MB at a fifth | MB at the end | descriptors at a fifth, end | MB an hour of data, second half | MB more in 24 h |",
        "|---|---|---|---|---|---|",
    ]
    flat = bool(looks)
    for node, found in looks.items():
        values = np.array(found, dtype=np.float64)
        early, half = values[len(values) // 5], values[len(values) // 2 :]
        slope = float(np.polyfit(half[:, 0], half[:, 1], 1)[0]) if len(half) > 3 else 0.0
        flat &= slope < FLAT and values[-1, 2] <= early[2] + 3
        descriptors = f"{early[2]:.0f}, {values[-1, 2]:.0f}"
        lines.append(f"| {node} | {early[1]:.0f} | {values[-1, 1]:.0f} | {descriptors} | {slope:+.2f} | {24 * slope:+.0f} |")
    lost = ", ".join(f"{key} {value}" for key, value in streams.items() if key.startswith("stream: ") and value != "0") or "none"
    lines += ["", f"- samples paired: {streams.get('samples paired', '0')}; lost, dropped or refused: {lost}"]
    return "\n".join(lines) + "\n", flat


def main(words: list[str]) -> int:
    """Run, print and write the page; returns 1 if a process grows."""
    from campaigns.faults.groups import GROUPS
    from campaigns.faults.report import text

    parser = argparse.ArgumentParser(prog="faults soak", description="a day of data, with memory and descriptors of each node")
    parser.add_argument("--hours", type=float, default=24.0, help="of data")
    parser.add_argument("--speed", default="max", help="times real time, or max")
    parser.add_argument("--block", type=int, default=20, help="samples of a message; larger ones go through faster")
    parser.add_argument("--minutes", type=float, default=1e9, help="stop after so many minutes, and draw the line on")
    parser.add_argument("-o", type=Path, default=PAGE, metavar="FILE", help="page to write (docs/faults.md)")
    asked = parser.parse_args(words)
    begun = time.monotonic()
    data, looks, streams = measure(asked.hours, 0.0 if asked.speed == "max" else float(asked.speed), asked.block, asked.minutes)
    made, flat = table(data, asked, looks, streams, (time.monotonic() - begun) / 60.0)
    sys.stderr.write(made)
    before = asked.o.read_text(encoding="utf-8") if asked.o.exists() else ""
    facts = before.partition("\nRun on ")[2].partition("\n")[0]
    asked.o.write_text(text({"Soak": made}, before, [*GROUPS.values(), "Soak"], facts), encoding="utf-8")
    return 0 if flat else 1
