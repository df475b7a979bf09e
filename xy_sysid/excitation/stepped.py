"""Stepped sine: one frequency after the other on a logarithmic axis, each for whole cycles, without a jump between them.

A dwell has as many cycles as fit in ``period``, at least one; the frequency is changed slightly so that they end on a sample. Each
dwell starts and ends at zero. After the last frequency the signal repeats.

Source: R. Pintelon, J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., section 5.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation.contract import Parts, below_nyquist, samples
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation


@dataclass(frozen=True, slots=True)
class Dwell:
    """One frequency, Hz, with its number of cycles and samples, from sample ``start`` of the schedule."""

    frequency: float
    cycles: int
    start: int
    samples: int


def schedule(settings: AxisExcitation, rate: float) -> tuple[Dwell, ...]:
    """The dwells from low to high; raises BadInput if low is 0 (a log axis has no 0) or a cycle is too long."""
    below_nyquist(settings, rate)
    if settings.low <= 0:
        raise BadInput("low", f"{settings.low:g} Hz", "above 0 Hz for a stepped sine", "Raise low.")
    dwells: list[Dwell] = []
    start = 0
    for wanted in np.geomspace(settings.low, settings.high, settings.steps):
        cycles = max(1, int(settings.period * wanted))
        length = samples(cycles / wanted, rate, 2, "dwell")
        while cycles / length >= 0.5:  # rounding may not push the frequency to Nyquist
            length += 1
        dwells.append(Dwell(cycles * rate / length, cycles, start, length))
        start += length
    return tuple(dwells)


def _repeat(dwells: tuple[Dwell, ...], amplitude: float) -> Iterator[FloatArray]:
    while True:
        for dwell in dwells:
            yield amplitude * np.sin(2 * np.pi * dwell.cycles / dwell.samples * np.arange(dwell.samples))


def stepped_sine(settings: AxisExcitation, rate: float) -> Parts:
    """Sine of the set rms at each frequency of ``schedule``, which may raise BadInput; stores one dwell at a time."""
    return Parts.of(_repeat(schedule(settings, rate), np.sqrt(2) * settings.rms))
