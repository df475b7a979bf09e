"""Random settings, positions, ages and states: an axis last measured at or beyond a limit gets no outward voltage; beyond it, the drive ends."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.faults.attack import Attack, Found
from xy_sysid.errors import BadInput
from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block
from xy_sysid.settings import AxisExcitation, ExcitationSettings

WORDS = (
    "All allowed settings of an axis, with random positions, ages of positions, stalls and stops. There must be no outward voltage at or beyond a "
    "travel limit and no voltage above the amplitude limit; an axis that stays outside must end at zero volts."
)
ROWS, RATE = 20, 2000.0
KINDS = ("noise", "off", "multisine", "sweep", "step", "impulse", "prbs")


def axis_settings(random: np.random.Generator) -> dict[str, Any]:
    """Random settings of one axis."""
    low, width = float(random.uniform(-10, 10)), float(10 ** random.uniform(-3, 1.3))
    return {
        "kind": str(random.choice(KINDS)),
        "rms": float(10 ** random.uniform(-3, 2)),
        "limit": float(10 ** random.uniform(-3, 3)),
        "offset": float(random.uniform(-100, 100)) * float(random.random() < 0.6),
        "centring": float(10 ** random.uniform(-3, 4)) * float(random.random() < 0.7),
        "travel_min": low,
        "travel_max": low + width,
        "brake": width * float(random.uniform(1e-3, 0.49)),
        "brake_voltage": float(10 ** random.uniform(-3, 2)),
        "velocity_gain": float(random.choice([0.0, 1e-4, 0.1, 10.0])),
    }


def place(seq: int, values: list[float]) -> Block:
    """A block of positions; ``seq`` is the counter of the newest."""
    count = np.arange(seq - len(values) + 1, seq + 1, dtype=np.float64)
    return Block(("x",), count, count / RATE, np.array(values)[:, None])


def never_outward(tries: int, folder: Path) -> Iterator[Found]:
    """Tries with random settings and a random walk of positions."""
    for number in range(tries):
        random = np.random.default_rng((51, number))
        wanted = axis_settings(random)
        try:
            drive = Drive(ExcitationSettings(axes={"x": AxisExcitation(**wanted)}, ramp=float(random.uniform(0, 1))))
        except BadInput:
            yield Found("one line")
            continue
        drive.start()
        yield _walked(drive, wanted, random, f"seed (51, {number})")


def _walked(drive: Drive, wanted: dict[str, Any], random: np.random.Generator, what: str) -> Found:
    low, high = wanted["travel_min"], wanted["travel_max"]
    seen, counter = np.nan, 0
    for k in range(12):
        if random.random() < 0.1:
            drive.stop("told to", 0.02)
        if random.random() < 0.1:
            drive.tick(k * 0.3)
        at = (low + high) / 2 + float(random.uniform(-2, 2)) * (high - low) / 2
        if drive.see(place(counter, [at - float(random.normal()) * 0.01 * (high - low), at])):
            seen = at
        late = int(random.integers(0, 200)) if random.random() < 0.5 else 0
        drive.skip(late)
        voltage = drive.next(ROWS).values[:, 0]
        counter = max(counter + ROWS, drive.seq - int(random.integers(0, 60)))
        if not np.isfinite(voltage).all() or np.abs(voltage).max() > wanted["limit"]:
            return Found("silent", note=f"{what}: {voltage} beyond the limit {wanted['limit']}")
        if (seen >= high and voltage.max() > 0) or (seen <= low and voltage.min() < 0):
            return Found("silent", note=f"{what}: outward at {seen} of {low} .. {high}: {voltage}")
    return Found("full")


def outside(tries: int, folder: Path) -> Iterator[Found]:
    """A position beyond a limit by less than a zone, which stays, creeps outward, or fluctuates."""
    for number in range(tries):
        random = np.random.default_rng((52, number))
        side, beyond = float(random.choice([-1.0, 1.0])), float(random.uniform(0.001, 0.018))
        creep, tremble = float(random.choice([0.0, 0.0, 0.002])), float(random.choice([2e-7, 5e-6, 5e-5]))
        drive = Drive(ExcitationSettings(axes={"x": AxisExcitation(rms=float(random.uniform(0, 3)), seed=number + 1)}, ramp=0.0))
        drive.start()
        now, zero = 0.0, np.nan
        for k in range(300):
            drive.tick(now)
            at = side * (0.14 + beyond + creep * now) + tremble * float(random.normal())
            drive.see(place(k * ROWS, [at, at]))
            moving = drive.next(ROWS).values.any()
            now += ROWS / RATE
            zero = now if moving else zero
            if drive.state == "stopped":
                break
        good = drive.fault and bool(drive.reason) and zero < 0.7
        yield Found("zero volts" if good else "too late", zero, note="" if good else f"seed (52, {number}): {drive.state} {drive.reason!r} {zero}")


ATTACKS = (
    Attack("settings, places and states", never_outward, 4000, 150, "never outward beyond a limit"),
    Attack("outside and not coming back", outside, 200, 10, "700 ms"),
)
