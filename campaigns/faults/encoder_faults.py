"""A driven machine whose encoder fails: time until zero volts, and travel until rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xy_sim.machine import Machine
from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

N, RATE = 20, 2000.0


def frozen(block: Block, good: Block) -> Block:
    """A position that stays constant while the counter continues."""
    return replace(block, values=np.tile(good.values[-1], (len(block), 1)))


def moved(metres: float) -> Callable[[Block, Block], Block]:
    """A position that jumps by ``metres``."""
    return lambda block, good: replace(block, values=block.values + metres)


def scaled(factor: float, about_here: bool = False) -> Callable[[Block, Block], Block]:
    """A position in another unit, or with another step size from the present position on."""

    def fault(block: Block, good: Block) -> Block:
        here = good.values[-1] if about_here else 0.0
        return replace(block, values=here + factor * (block.values - here))

    return fault


FAULTS: dict[str, Callable[[Block, Block], Block | None]] = {
    "silent": lambda block, good: None,
    "not a number": lambda block, good: replace(block, values=np.full_like(block.values, np.nan)),
    "frozen while driven": frozen,
    "the same block again": lambda block, good: good,
    "jump of 20 mm": moved(0.02),
    "leap of a range": moved(0.28),
    "reversed sign": scaled(-1.0, about_here=True),
    "1000 times too large": scaled(1000.0),
    "1000 times too small": scaled(0.001, about_here=True),
    "one axis missing": lambda block, good: Block(("x",), block.seq, block.time, block.values[:, :1]),
    "stamps from the past": lambda block, good: replace(block, time=block.time - 5.0),
    "counters from the past": lambda block, good: replace(block, seq=block.seq - 1500),
}
FROM_THE_START = ("frozen while driven", "reversed sign", "1000 times too large", "1000 times too small")


@dataclass(frozen=True, slots=True)
class Outcome:
    """reason: of the drive; seconds: from the fault to zero volts; travel: m, largest distance from the fault's position; place: m, from 0."""

    reason: str
    fault: bool
    seconds: float
    travel: float
    place: float


def settings(axis: dict[str, Any], axes: tuple[str, ...] = ("x", "y"), **more: Any) -> ExcitationSettings:
    """Settings with equal values for every axis, and a different seed for each."""
    return ExcitationSettings(axes={name: AxisExcitation(**{"seed": k, **axis}) for k, name in enumerate(axes, start=1)}, **more)


def run(machine: Machine, drive: Drive, seconds: float, fault: Callable[[Block, Block], Block | None] | None = None, at: float = 0.0) -> Outcome:
    """Drive with a simulated clock; from ``at`` s on the encoder has the fault. Afterwards the machine coasts at zero volts."""
    drive.start()
    answer: Block | None = None
    good: Block | None = None
    now, zero_at = 0.0, np.nan
    before: FloatArray = np.zeros(len(machine.axes))
    path: list[FloatArray] = []
    while now < seconds and drive.state != "stopped":
        drive.tick(now)
        if answer is not None:
            drive.see(answer)
        block = drive.next(N)
        true = Block(block.axes, block.seq, block.time, machine.step(block.values))
        if good is None or now < at or fault is None:
            answer = good = true
            before, path = true.values[-1], []
        else:
            answer = fault(true, good)
        path.append(true.values)
        now += N / RATE
        zero_at = now if block.values.any() else zero_at
    path.append(machine.step(np.zeros((600, len(machine.axes)))))
    places = np.vstack(path)
    start = max(at, N / RATE)
    return Outcome(
        reason=drive.reason,
        fault=drive.fault,
        seconds=float(zero_at - start),
        travel=float(np.abs(places - before).max()),
        place=float(np.abs(places).max()),
    )
