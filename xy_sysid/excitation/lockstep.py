"""Excitation and machine in lockstep, without ROS and without a clock: each block uses the positions of an earlier one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import ExcitationSettings

OFTEN = 200  # blocks between two progress reports


class Machine(Protocol):
    """A machine that can be driven: the simulated one, or another that takes blocks."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, one per column."""

    def step(self, voltage: FloatArray) -> FloatArray:
        """(n, axes) V, held -> (n, axes) m at the same instants."""


def drive(machine: Machine, settings: ExcitationSettings, duration: float, tell: Callable[[float], None] = lambda seconds: None) -> Recording:
    """The recording of ``duration`` s of excitation; block k uses the positions of block k - ahead.

    tell: called regularly with the elapsed s of the recording
    """
    driver = Drive(settings, watched=False)
    total = round(duration * settings.rate)
    voltage, position = np.empty((2, total, len(machine.axes)))
    driver.start()
    driver.see(Block(machine.axes, np.zeros(1), np.zeros(1), np.zeros((1, len(machine.axes)))))
    answers: list[Block] = []
    done = 0
    while done < total:
        if len(answers) >= settings.ahead:
            driver.see(answers.pop(0))
        block = driver.next(min(settings.block, total - done))
        answer = machine.step(block.values)
        answers.append(Block(machine.axes, block.seq, block.time, answer))
        voltage[done : done + len(block)], position[done : done + len(block)] = block.values, answer
        done += len(block)
        if done % (OFTEN * settings.block) == 0:
            tell(done / settings.rate)
    seq = np.arange(total)
    return Recording(
        sampling_rate=settings.rate,
        axes=machine.axes,
        seq=seq,
        time=seq / settings.rate,
        voltage=voltage,
        position=position,
        input_unit=settings.units.input,
        output_unit=settings.units.output,
        source="simulated",
    )
