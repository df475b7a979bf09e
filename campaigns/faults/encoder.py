"""An encoder that fails during noise, a constant voltage or a sweep: zero volts and rest within the bounds of docs/real-machine-safely.md."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from campaigns.faults.attack import Attack, Found
from campaigns.faults.encoder_faults import FAULTS, FROM_THE_START, run, settings
from xy_sim.machine import Machine
from xy_sysid.excitation.drive import Drive

WORDS = (
    "The drive of the excitation node, with a simulated table and clock, is excited with noise of 2 V rms. From a random moment on, the encoder "
    "is wrong. Longest: from the fault to zero volts. Travel: from the fault to rest. The bounds are those of [a real machine, "
    "safely](real-machine-safely.md)."
)
DOC = Path(__file__).parents[2] / "docs" / "real-machine-safely.md"
STOP = 0.15  # m, the end stop of the simulated table


def promised() -> dict[str, tuple[float, float]]:
    """Bounds from the table in the docs: s until zero volts and m until rest, by fault."""
    rows = re.findall(r"^\| ([\w ]+) \| ([\d.]+) ms \| ([\d.]+) mm \|", DOC.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: (float(time) / 1000, float(way) / 1000) for name, time, way in rows}


def while_driven(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries with one fault, each with other noise and at another time."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        seconds, way = promised()[name]
        for number in range(count):
            random = np.random.default_rng((41, number))
            seed, at = int(random.integers(1, 10_000)), float(random.uniform(0.7, 2.0))
            found = run(Machine.from_file("rigid.yaml", seed), Drive(settings({"rms": 2.0, "seed": seed})), 25.0, FAULTS[name], at=at)
            good = found.fault and bool(found.reason) and found.seconds <= seconds and found.travel <= way and found.place < STOP
            note = "" if good else f"seed {seed}, from {at:.3f} s: {found}"
            yield Found("zero volts" if good else "too late", found.seconds if good else 0.0, found.travel if good else 0.0, note)

    return tries


def from_the_start(name: str) -> Callable[[int, Path], Iterator[Found]]:
    """Tries with a fault from the start: the axis must come to rest before the end stop."""

    def tries(count: int, folder: Path) -> Iterator[Found]:
        for number in range(count):
            seed = 1000 + number
            found = run(Machine.from_file("rigid.yaml", seed), Drive(settings({"rms": 2.0, "seed": seed})), 25.0, FAULTS[name])
            good = found.fault and found.place < STOP
            yield Found("zero volts" if good else "too late", found.seconds, found.place, "" if good else f"seed {seed}: {found}")

    return tries


ATTACKS = (
    *(Attack(name, while_driven(name), 25, 1, f"{1000 * promised()[name][0]:.0f} ms, {1000 * promised()[name][1]:.0f} mm") for name in FAULTS),
    *(Attack(f"{name}, from the start", from_the_start(name), 15, 1, "before the end stop") for name in FROM_THE_START),
)
