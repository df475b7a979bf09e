"""Ratios of a motion to that of the reference machine, for which bounds and usual sizes of effects are given.

A result must not depend on whether an axis is measured in metres, radians or encoder counts, driven by volts, amperes or newtons,
or slow or fast (similarity; Barenblatt, Scaling, 2003, ch. 1). So bounds, typical values and steps in an effect's file are those
of one reference machine, and are scaled to another by the unit of each parameter.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

import numpy as np

from xy_sysid.samples.block import FloatArray

SPEED, VOLTAGE = 0.025, 1.0  # rms, m/s and V, of the reference machine: a ball-screw table driven with noise
RATE = 2000.0  # Hz; a machine with faster sampling is not considered quicker, one with slower sampling is considered slower
UNIT = re.compile(r"(V|m|s)\^?(\d*)")


@dataclass(frozen=True, slots=True)
class Similarity:
    """Size of one unit of the reference machine, in SI units.

    length: m; time: s; voltage: V
    """

    length: float = 1.0
    time: float = 1.0
    voltage: float = 1.0

    @staticmethod
    def of(sampling_rate: float, voltage: FloatArray, velocity: FloatArray) -> Similarity:
        """Ratios of a motion: (n,) V, (n,) m/s. A signal without variation counts as the reference machine's."""
        time = max(1.0, RATE / sampling_rate)
        speed, drive = float(np.std(velocity)) / SPEED, float(np.std(voltage)) / VOLTAGE
        return Similarity(length=(speed or 1.0) * time, time=time, voltage=drive or 1.0)

    def factor(self, unit: str) -> float:
        """Ratio to the reference machine for a unit of V, m and s; other units (rad, numbers) give 1.

        Hz also gives 1: the name of a resonance depends on its frequency, at any sampling rate.
        """
        volts, lengths, times = _powers(unit)
        return self.voltage**volts * self.length**lengths * self.time**times


@cache
def _powers(unit: str) -> tuple[int, int, int]:
    """Powers of V, m and s: V/(m/s) is (1, -1, 1)."""
    above, _, below = unit.partition("/")
    below = below.strip("()") if below.startswith("(") else below.replace("/", " ")  # V/m/s is V per m and per s
    found = {"V": 0, "m": 0, "s": 0}
    for name, power in UNIT.findall(above):
        found[name] += int(power or 1)
    inner = _powers(below) if below else (0, 0, 0)
    return found["V"] - inner[0], found["m"] - inner[1], found["s"] - inner[2]


USUAL = Similarity()
