"""The nodes on two hosts with a bad cable between them: messages, dropped data, time until recovery, and correctness of the response."""

from __future__ import annotations

import functools
import importlib.util
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found, environment
from campaigns.faults.cable import hosts, why_not

WORDS = (
    "Two hosts (network namespaces, each with a TAP device, and a cable that loses frames at random with a fixed seed; no `tc netem` is needed): "
    "the drive, "
    "with a watchdog of 50 ms, and the excitation on one, the identifier on the other; 2 kHz, two axes, windows of 1024. Longest: until data or "
    "identification continue. A response is right if 95 % of its lines from 5 to 200 Hz lie within three sigma of the response without loss."
)
PROFILE = Path(__file__).parents[2] / "config" / "fastdds.xml"
SECONDS = 15.0
WITHIN, LINES = 3.0, 0.95
NODES = ("ballscrew", "excitation", "identifier")


@functools.cache
def _reason() -> str:
    if importlib.util.find_spec("rclpy") is None:
        return "ROS 2 is not installed"
    return why_not()


def measure(folder: Path, scenario: str, *arguments: Any, profile: bool = True, remote: bool = False) -> dict[str, Any]:
    """Run one scenario on two fresh hosts."""
    folder.mkdir(parents=True, exist_ok=True)
    with hosts(folder) as made:
        asked = {
            "scenario": scenario,
            "arguments": arguments,
            "folder": str(folder),
            "remote": remote,
            "hosts": {"machine": made.machine, "desk": made.desk, "orders": made.orders},
        }
        words = ["ip", "netns", "exec", made.desk, sys.executable, "-m", "campaigns.faults.desk", json.dumps(asked)]
        surroundings = environment(ROS_DOMAIN_ID=str(os.getpid() % 90 + 10), ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
        surroundings.pop("FASTRTPS_DEFAULT_PROFILES_FILE", None)
        if profile:
            surroundings["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(PROFILE)
        done = subprocess.run(words, cwd=Path(__file__).parents[2], env=surroundings, capture_output=True, text=True, timeout=600, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{scenario}: {done.stderr[-600:]}")
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


_reference: dict[str, list[float]] = {}


def right(response: dict[str, list[float]]) -> float:
    """Fraction of the lines within the uncertainty of the response without loss."""
    if not response or not _reference or len(response["real"]) != len(_reference["real"]):
        return 0.0
    a, b = ({name: np.array(values, dtype=np.float64) for name, values in one.items()} for one in (response, _reference))
    away = np.hypot(a["real"] - b["real"], a["imag"] - b["imag"])
    return float(np.mean(away <= WITHIN * np.hypot(a["sigma"], b["sigma"])))


def _row(found: dict[str, Any], seconds: float | None, what: str, must: bool = True) -> Found:
    inside = right(found["response"])
    reasons = ", ".join(f"{name} {count}" for name, count in found["reasons"].items()) or "nothing lost"
    note = f"{what}: {found['windows']:.0f} windows, {found['dropped']:.0f} dropped, {100 * inside:.0f} % of the lines in the band; said: {reasons}"
    if found["streams"]:
        note += f" ({found['streams']})"
    good = must and seconds is not None and found["windows"] > 0 and inside >= LINES and not found["tracebacks"]
    if not good:
        return Found("silent" if must else "not told", seconds or 0.0, note=f"{note}; {found['tracebacks']} {seconds}")
    return Found("part-and-said" if found["dropped"] or found["reasons"] else "full", seconds or 0.0, note=note)


def _attack(work: Callable[[int, Path], Iterator[Found]]) -> Callable[[int, Path], Iterator[Found]]:
    def tries(count: int, folder: Path) -> Iterator[Found]:
        if _reason():
            yield Found("skipped", note=_reason())
            return
        if not _reference:
            _reference.update(measure(folder / "reference", "loss", 0.0, 25.0)["response"])
        yield from work(count, folder)

    return tries


def lossy(part: float, profile: bool) -> Callable[[int, Path], Iterator[Found]]:
    """A given loss, with or without the profile."""

    def work(count: int, folder: Path) -> Iterator[Found]:
        found = measure(folder / "loss", "loss", part, SECONDS, profile=profile)
        what = (
            f"until the first window {found['until first window']:.1f} s, longest pause {found['stall']:.1f} s"
            if found["until first window"]
            else "no window"
        )
        yield _row(found, found["stall"], what)

    return _attack(work)


def remote_lossy(part: float) -> Callable[[int, Path], Iterator[Found]]:
    """Loss with the excitation on the other host: it continues, or ends at zero volts with the reason."""

    def work(count: int, folder: Path) -> Iterator[Found]:
        found = measure(folder / "remote", "loss", part, SECONDS, remote=True)
        if found["active"] or found["windows"]:
            yield _row(found, found["stall"], "the excitation drives across the cable" if found["active"] else "the excitation ended by its watchdog")
        else:
            yield Found("zero volts", note=f"the excitation ended by its watchdog: {found['reasons']}")

    return _attack(work)


def cable(away: float, remote: bool) -> Callable[[int, Path], Iterator[Found]]:
    """The cable is pulled for ``away`` s."""

    def work(count: int, folder: Path) -> Iterator[Found]:
        found = measure(folder / "pulled", "pulled", away, 8.0, remote=remote)
        stopped = found.get("stopped", True)
        what = f"pulled for {away:g} s" + (", the drive across it ended at zero volts and was activated again" if remote else "")
        yield _row(found, found["until it goes on"], what, stopped and found.get("again", True))

    return _attack(work)


def joins(count: int, folder: Path) -> Iterator[Found]:
    """The identifier joins late."""
    found = measure(folder / "late", "late", 8.0)
    yield _row(found, found["until first window"], "joined 5 s late")


def killed(count: int, folder: Path) -> Iterator[Found]:
    """kill -9 and restart of every node, in every order."""
    for number, order in enumerate(list(itertools.permutations(NODES))[:count]):
        found = measure(folder / f"order{number}", "restarts", list(order), 8.0)
        yield _row(found, found["until it goes on"], " then ".join(order))


def clocks(count: int, folder: Path) -> Iterator[Found]:
    """Jumps of the clock, and a change of the rate."""
    found = measure(folder / "clocks", "clocks", 2.0)
    said = str(found["identifier"]) + str(found["streams"]) + str(found["axis"]) + json.dumps(found["reasons"])
    told = {"the rate": "rate" in said, "the clock": "time" in said or "clock" in said or "stamp" in said}
    good = found["windows"] > 0 and all(told.values()) and not found["tracebacks"] and found["until first window"]
    note = f"{found['windows']:.0f} windows, {found['dropped']:.0f} dropped; said: {found['reasons']} ({found['streams']})"
    yield Found("part-and-said" if good else "not told", found["until first window"] or 0.0, note=note if good else f"{note}; {told}; {said[-400:]}")


ATTACKS = (
    Attack("loss of 0.1 %", lossy(0.001, True), 1, 0, "goes on"),
    Attack("loss of 1 %", lossy(0.01, True), 1, 0, "goes on"),
    Attack("loss of 5 %", lossy(0.05, True), 1, 0, "goes on"),
    Attack("loss of 1 %, without the profile", lossy(0.01, False), 1, 0, "said"),
    Attack("loss of 1 %, excitation across the cable", remote_lossy(0.01), 1, 0, "goes on, or zero volts"),
    Attack("cable pulled for 2 s and back", cable(2.0, False), 1, 0, "goes on"),
    Attack("cable pulled for 15 s and back", cable(15.0, False), 1, 0, "goes on"),
    Attack("cable pulled for 2 s, excitation across it", cable(2.0, True), 1, 0, "zero volts, then goes on"),
    Attack("late joiner", _attack(joins), 1, 0),
    Attack("kill -9 and restart of every node, in every order", _attack(killed), 6, 0),
    Attack("clock jumps and another rate", _attack(clocks), 1, 0, "said"),
)
