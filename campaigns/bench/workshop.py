"""A simulated year of a workshop: similar machines, their wander, and three with different faults.

Half of them are on rigid foundations, the others on feet, with a base resonance near 48 Hz.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from xy_sim.drive import Drive
from xy_sim.machine import Machine
from xy_sim.machine_file import Axis, Spec
from xy_sysid.excitation.lockstep import drive
from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings

BEGIN = datetime(2025, 1, 6)
YEAR = 365.0  # days
WANDER = {"gain": 0.005, "pole": 0.02, "friction": 0.025, "frequency": 0.003}  # between recordings, fraction of the value
SEASON = {"gain": 0.003, "pole": 0.02, "friction": 0.02, "frequency": 0.001}  # amplitude over the year, with the temperature of the hall


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault. begin: fraction of the year; friction, gain, frequency: factor at the end, reached over a tenth of a year; gap: m at the end."""

    name: str
    begin: float
    friction: float = 1.0
    gain: float = 1.0
    frequency: float = 1.0
    gap: float = 0.0


NUT = Fault("a worn nut", 0.5, friction=1.35, gap=12e-6)
BOLTS = Fault("loose bolts of the base", 0.6, frequency=0.93)
AMPLIFIER = Fault("the amplifier or its supply", 0.4, gain=0.88)
FAULTS = {"mill-04": NUT, "mill-11": BOLTS, "mill-17": AMPLIFIER}


@dataclass(frozen=True, slots=True)
class Workshop:
    """Extent of the simulation: machines, recordings of each over the year, and s of each."""

    machines: int = 20
    recordings: int = 10
    seconds: float = 20.0
    seed: int = 1
    faults: dict[str, Fault] = field(default_factory=lambda: dict(FAULTS))

    def names(self) -> list[str]:
        """Names of the machines."""
        return [f"mill-{number + 1:02d}" for number in range(self.machines)]

    def days(self) -> list[datetime]:
        """Dates of the recordings, evenly over the year."""
        return [BEGIN + timedelta(days=round(YEAR * k / self.recordings)) for k in range(self.recordings)]

    def made(self, folder: Path) -> Iterator[Path]:
        """Simulate and write every missing recording: MACHINE/DATE.npz."""
        for number, name in enumerate(self.names()):
            for k, day in enumerate(self.days()):
                path = folder / name / f"{day:%Y-%m-%d}.npz"
                if not path.exists():
                    save(self.recording(number, k), path)
                yield path

    def recording(self, number: int, k: int) -> Recording:
        """The recording of a machine on a day, driven with noise."""
        name, part = self.names()[number], k / self.recordings
        own = np.random.default_rng([self.seed, number])
        usual = {
            "gain": own.uniform(0.09, 0.105),
            "pole": own.uniform(220.0, 270.0),
            "friction": own.uniform(0.1, 0.16),
            "frequency": own.uniform(42.0, 55.0),
        }
        delay, phase = own.uniform(1.1e-3, 1.5e-3), own.uniform(-0.3, 0.3)
        today = np.random.default_rng([self.seed, number, k])
        season = math.sin(2.0 * math.pi * part + phase)
        now = {what: value * (1.0 + SEASON[what] * season + WANDER[what] * today.standard_normal()) for what, value in usual.items()}
        fault = self.faults.get(name, Fault("", 2.0))
        grown = min(max((part - fault.begin) / 0.1, 0.0), 1.0)
        for what, factor in (("friction", fault.friction), ("gain", fault.gain), ("frequency", fault.frequency)):
            now[what] *= 1.0 + grown * (factor - 1.0)
        now["friction"] /= 1.0 + grown * (fault.gain - 1.0)  # in volts of a drive with less force per volt
        parts = {
            "time_delay": {"delay": delay},
            "coulomb_friction": {"coulomb": now["friction"]},
        }
        if number >= self.machines // 2:
            parts["base_resonance"] = {"frequency": now["frequency"], "mass": 120.0, "damping": 0.015}
        if fault.gap * grown > 0.0:
            parts["backlash"] = {"gap": fault.gap * grown}
        axis = Axis("x", Drive(velocity_gain=now["gain"], pole=now["pole"], encoder_noise=0.1e-6), _complete(parts))
        seed = 1000 * number + k + 1
        machine = Machine(Spec((axis,)), seed)
        return drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes={"x": AxisExcitation(seed=seed)}), self.seconds)


def _complete(parts: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    """The parts with default values for missing ones."""
    from xy_sim.machine_file import parts_from

    return {name: dict(values) for name, values in parts_from(parts, "workshop").items()}
