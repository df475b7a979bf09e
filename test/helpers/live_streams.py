"""Streams of a simulated machine, block by block, and the identifier's results."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.live.fitter import Update
from xy_sysid.samples.block import Block
from xy_sysid.samples.pairing import Quantity
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings

AXES = ("x", "y")


def recorded(machine: str, seconds: float, seed: int = 11) -> Recording:
    axes = {axis: AxisExcitation(seed=seed + k) for k, axis in enumerate(AXES)}
    settings = ExcitationSettings(lockstep=True, speed=0.0, block=100, ahead=1, axes=axes)
    return drive(Machine.from_file(machine, seed), settings, seconds, lambda _: None)


def blocks(recording: Recording, size: int = 20) -> Iterator[tuple[Quantity, Block]]:
    seq = recording.seq.astype(float)
    for start in range(0, len(recording), size):
        rows = slice(start, start + size)
        yield "voltage", Block(AXES, seq[rows], recording.time[rows], recording.voltage[rows])
        yield "position", Block(AXES, seq[rows], recording.time[rows], recording.position[rows])


def last(updates: Iterator[Update]) -> Update:
    *_, final = updates
    return final
