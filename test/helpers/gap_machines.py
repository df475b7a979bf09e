"""Motors that move a table across a gap, independent of ``xy_sim`` and the effects: another contact, other time steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

STEP = 10e-6  # s


@dataclass(frozen=True, slots=True)
class GapMachine:
    """One axis; speeds and forces are those of its rigid part.

    gap: encoder counts; contact, damping: Hz and ratio of the closed contact on the reduced mass; hertz: force by depth^1.5
    share: the motor's part of the mass; guide: the table's part of the drag
    motor_rubs, table_rubs: dry friction on either side over the rms drive
    counts: rms of a sample's motion, in counts; pole: rad/s
    """

    gap: float
    contact: float
    damping: float
    hertz: bool = False
    share: float = 0.6
    guide: float = 0.1
    motor_rubs: float = 0.0
    table_rubs: float = 0.0
    counts: float = 40.0
    pole: float = 100.0
    count: float = 0.5e-6
    fs: float = 2000.0
    delay: float = 0.6e-3
    seconds: float = 20.0


def driven(machine: GapMachine, seed: int) -> tuple[FloatArray, FloatArray]:
    """(n,) drive, V, noise of 1 V up to 300 Hz, and (n,) position, m, as the encoder shows it."""
    noise = np.random.default_rng(seed).standard_normal(int(machine.seconds * machine.fs))
    noise = scipy.signal.sosfilt(scipy.signal.butter(4, (0.5, 300.0), "bandpass", fs=machine.fs, output="sos"), noise)
    drive = noise / noise.std()
    decay = np.exp(-machine.pole / machine.fs)
    rigid = float(np.std(scipy.signal.lfilter([1.0 - decay], [1.0, -decay], drive)))  # m/s for a gain of 1 m/s/V
    speed = machine.counts * machine.count * machine.fs
    turn = 2.0 * np.pi * machine.contact
    numbers = np.array(
        [
            speed / rigid,
            machine.pole,
            machine.share,
            machine.guide,
            0.5 * machine.gap * machine.count,
            turn,
            machine.damping,
            0.3 * speed / turn if machine.hertz else 0.0,
            machine.motor_rubs,
            machine.table_rubs,
        ]
    )
    shown = _run(drive, numbers, round(1.0 / (machine.fs * STEP)), round(machine.delay / STEP))
    return drive, np.round(shown / machine.count) * machine.count


@compiled
def _run(drive: FloatArray, numbers: FloatArray, steps: int, late: int) -> FloatArray:
    """The position at each sample: explicit steps; friction stops each side within a step. Hertz: given stiffness at the typical depth."""
    gain, pole, share, guide, half, turn, damping, usual, motor_rubs, table_rubs = numbers
    reduced, table = share * (1.0 - share), 1.0 - share
    h, x, v, x2, v2, shown = STEP, 0.0, 0.0, 0.0, 0.0, np.empty(drive.size)
    for i in range(drive.size * steps):
        if i % steps == 0:
            shown[i // steps] = x
        volts = drive[(i - late) // steps] if i >= late else 0.0
        side = 1.0 if x > x2 else -1.0
        deep, closing, push = side * (x - x2) - half, side * (v - v2), 0.0
        if deep > 0.0:
            stiff = np.sqrt(deep / usual) if usual > 0.0 else 1.0
            losses = 2.0 * damping / turn * closing * (stiff * deep / usual if usual > 0.0 else 1.0)
            push = side * max(reduced * turn * turn * (stiff * deep + losses), 0.0)
        v += h * (pole * (gain * volts - (1.0 - guide) * v) - push) / share
        stops = h * pole * gain * motor_rubs / share
        v -= min(max(v, -stops), stops)
        v2 += h * (push - pole * guide * v2) / table
        stops = h * pole * gain * table_rubs / table
        v2 -= min(max(v2, -stops), stops)
        x += h * v
        x2 += h * v2
    return shown
