"""Simulation of an axis without measured motion: its position, and its voltage with centring.

``simulator`` uses the measured position wherever a law depends on position. Here the position follows from the simulated motion, and the
excitation's centring follows from that position.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.loop_source import BASE
from xy_sysid.axis.model import FINE, AxisModel
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class DriveInput:
    """The drive of an axis.

    voltage: (n,) V, without centring; pull: (n,) V/m, centring towards the start; limit: V; seen: age of the position in the centring, samples
    start: m, the position at the first sample
    """

    voltage: FloatArray
    pull: FloatArray
    limit: float
    seen: int = 0
    start: float = 0.0


@dataclass(frozen=True, slots=True)
class Motion:
    """A recording without noise: voltage (n,), V, held to the next sample; position (n,), m, as the encoder shows it."""

    sampling_rate: float
    voltage: FloatArray
    position: FloatArray


def move(model: AxisModel, sampling_rate: float, drive: DriveInput, fine: float = FINE) -> Motion:
    """The motion of an axis model from rest; fine: Hz, sub-steps for laws that depend on speed."""
    chosen = [model.library[name] for name, _ in model.effects]
    library = model.library.looped(chosen)
    row, on = np.ones(len(library.places)), np.zeros(len(library.acting), dtype=np.uint8)
    names = (*BASE, *(f"{effect.name}.{key}" for effect in chosen for key in effect.names))
    row[[library.places[name] for name in names]] = model.row
    acting = [effect.name for effect in library.acting]
    for name, values in model.effects:
        on[acting.index(name)] = values[0] != 0.0
    n = drive.voltage.size
    place, speed, sent = np.zeros(n + 1), np.zeros(n), np.zeros(n)
    place[0] = drive.start
    with np.errstate(all="ignore"):  # a model may diverge
        library.moving(
            np.ascontiguousarray(drive.voltage, dtype=np.float64),
            place,
            row,
            on,
            float(sampling_rate),
            fine,
            0.0,
            speed,
            np.ascontiguousarray(drive.pull, dtype=np.float64),
            float(drive.limit),
            int(drive.seen),
            sent,
        )
    position = drive.start + np.concatenate(([0.0], np.cumsum(speed[:-1]) / sampling_rate))
    return Motion(sampling_rate, sent, position)
