"""Ctrl-C, SIGTERM and kill -9 at any moment of every long command: the exit code names the signal, and no partial file remains."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from campaigns.faults.attack import Attack, Found, environment
from campaigns.faults.damage import truth
from xy_sysid.imports import load, save

WORDS = (
    "A signal at a random moment from the first instruction to the last: exit code 130 after Ctrl-C and 143 after SIGTERM, no traceback, and the "
    "folder contains either the old content or the complete new file. If the command ended before the signal, the next "
    "signal comes in half the time. Longest: from the signal to the end."
)
RIGID = ("--set", "numerator_order=0", "--set", "denominator_order=2")
COMMANDS: dict[str, tuple[tuple[str, ...], float]] = {
    "simulate, a bag": (("simulate", "OUT", "--duration", "100"), 4.0),
    "simulate, CSV": (("simulate", "OUT.csv", "--duration", "60"), 5.0),
    "simulate, MAT": (("simulate", "OUT.mat", "--duration", "100"), 4.0),
    "replay --out": (("replay", "BAG", "--out", "OUT"), 6.0),
    "fit --model": (("fit", "BAG", *RIGID, "--model", "OUT.yaml"), 5.0),
    "frf --csv": (("frf", "BAG", "--csv", "OUT.csv"), 3.0),
    "refine --auto --model": (("refine", "BAG", "--auto", "--model", "OUT.yaml"), 15.0),
    "diagnose": (("diagnose", "BAG"), 12.0),
    "compare": (("compare", "BAG"), 6.0),
    "study --out": (("study", "BAG", *RIGID, "--out", "OUT.html"), 8.0),
    "report -o": (("report", "BAG", "-o", "OUT.html"), 20.0),
    "page": (("page", "BAG", "--port", "0", "--no-browse"), 4.0),
    "record": (("record", "OUT"), 4.0),
    "run": (("run", "--params", "demo.yaml"), 5.0),
}
EARLIER = 6  # signals, each after half the time of the one before, until one comes before the answer
SLOWEST = 20.0  # s, limit from the signal to the end


def ended(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries with one command."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        import importlib.util

        words, seconds = COMMANDS[name]
        if name in ("record", "run", "page") and importlib.util.find_spec("rclpy") is None:
            yield Found("skipped", note="ROS 2 is not installed")
            return
        save(truth(16_000), folder / "bag")
        for number in range(count):
            random = np.random.default_rng((81, number))
            after = float(random.uniform(0.0, seconds))
            found = None
            for again in range(EARLIER):
                out = folder / f"out{number}_{again}"
                out.mkdir()
                places = {"BAG": str(folder / "bag")}
                given = [str(out / "made") + word[3:] if word.startswith("OUT") else places.get(word, word) for word in words]
                found = _try([sys.executable, "-m", "xy_sysid", *given], out, (signal.SIGINT, signal.SIGTERM)[number % 2], after / 2**again)
                if found is not None:
                    break
            yield found or Found("not told", note=f"{name}: each of {EARLIER} signals came after its end")

    return tries


def _try(command: list[str], out: Path, number: signal.Signals, after: float) -> Found | None:
    """The outcome of one signal; None if the command had given its answer before."""
    surroundings = environment(ROS_DOMAIN_ID=str(os.getpid() % 90 + 10), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    with (out.parent / "said").open("wb") as err:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=err, env=surroundings, cwd=out.parent)
        try:
            process.wait(after)
        except subprocess.TimeoutExpired:
            process.send_signal(number)
        begun = time.monotonic()
        try:
            code = process.wait(SLOWEST)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return Found("too late", note=f"{command[3:]}, {number.name} after {after:.3f} s: it does not end")
    seconds, said = time.monotonic() - begun, (out.parent / "said").read_text("utf-8", "replace")
    what = f"{command[3:]}, {number.name} after {after:.3f} s: code {code}, {said[-300:]!r}"
    if "Traceback" in said and code != -number:  # before Python has started, no handler exists
        return Found("traceback", note=what)
    left = sorted(item.name for item in out.iterdir())
    asked = {signal.SIGINT: 130, signal.SIGTERM: 143}[number]
    if code in (asked, -number):
        kept = command[3] == "record"  # its recording is kept on purpose
        return Found("full", seconds) if not left or (kept and left == ["made"]) else Found("stump", note=f"{what}: {left}")
    return None if code in (0, 1) else Found("not told", note=what)


def killed_recorder(tries: int, folder: Path) -> Iterator[Found]:
    """kill -9 of a process that writes a bag at full speed: all data that it reported as flushed are there, and the bag is complete."""
    program = (
        "import sys, time\n"
        "from campaigns.faults.damage import truth\n"
        "from xy_sysid.bags import BagWriter\n"
        "from xy_sysid.imports import blocks\n"
        "content = blocks(truth(4000))\n"
        "writer = BagWriter(sys.argv[1], sys.argv[2])\n"
        "begin = time.monotonic()\n"
        "for count in range(10**9):\n"
        "    voltage, position = content[count % 200]\n"
        "    shift = 4000 * (count // 200)\n"
        "    for kind, block in (('voltage', voltage), ('position', position)):\n"
        "        from dataclasses import replace\n"
        "        writer.write_block('/xy/' + kind, replace(block, seq=block.seq + shift, time=block.time + shift / 2000), 10_000_000 * count)\n"
        "    if count % 50 == 49:\n"
        "        writer.flush()\n"
        "        print(20 * (count + 1), flush=True)\n"
        "    time.sleep(max(0.0, begin + 0.001 * count - time.monotonic()))\n"
    )
    for number in range(tries):
        random = np.random.default_rng((82, number))
        path = folder / f"bag{number}"
        words = [sys.executable, "-c", program, str(path), ("sqlite3", "mcap")[number % 2]]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment(), cwd=Path(__file__).parents[2])
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(float(random.uniform(0.0, 1.0)))
        process.kill()
        told = [20 * 50, *(int(line) for line in process.stdout.read().split())]
        process.wait()
        process.stdout.close()
        found = load(path)
        good = len(found) >= max(told) and len(found.runs()) == 1
        yield Found("full" if good else "stump", note="" if good else f"seed (82, {number}): {len(found)} of {max(told)}, {found.notes}")


ATTACKS = (
    *(Attack(name, ended(name), 3, 2 if name == "simulate, a bag" else 0, "130, 143") for name in COMMANDS),
    Attack("kill -9 of a recorder", killed_recorder, 10, 2, "what was flushed is there"),
)
