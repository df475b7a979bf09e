"""One experiment: excitation and duration."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from xy_sysid.axis.forward import DriveInput
from xy_sysid.excitation import signal
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import USUAL, Units, readable

RAMP = float(ExcitationSettings.model_fields["ramp"].default)  # s of fade-in, by default
AGE = 0.04  # s: age of the position in the centring towards the start
KEPT = 64  # cached signals; only those that differ in more than the amplitude count
BANDED = ("noise", "multisine", "multisine_odd", "multisine_detect", "sweep", "stepped_sine", "prbs")  # kinds that have a band


@lru_cache(maxsize=KEPT)
def unit_signal(told: AxisExcitation, sampling_rate: float, n: int) -> FloatArray:
    """(n,) signal of rms 1, read-only and cached: many experiments differ only in amplitude, and each is simulated with many models."""
    made = signal(told, sampling_rate).next(n)
    made.setflags(write=False)
    return made


@dataclass(frozen=True, slots=True)
class Experiment:
    """excitation: of the axis, with its limits; seconds: of motion; ramp: s of fade-in."""

    excitation: AxisExcitation
    seconds: float = 0.0
    ramp: float = RAMP

    def lasting(self, seconds: float) -> Experiment:
        """The experiment with another duration."""
        return replace(self, seconds=seconds)

    def drive(self, sampling_rate: float, seconds: float, start: float) -> DriveInput:
        """The drive for an axis at position ``start``, as ``excitation.drive.Drive`` produces it within its guards."""
        told, n = self.excitation, round(seconds * sampling_rate)
        time = np.arange(n) / sampling_rate
        fade = 0.5 * (1.0 - np.cos(np.pi * np.minimum(time / self.ramp, 1.0))) if self.ramp else np.ones(n)
        voltage = told.rms * self._signal(sampling_rate, n) + told.offset + told.slow * np.sin(2.0 * np.pi * time / told.slow_period)
        return DriveInput(
            voltage=np.asarray(voltage * fade), pull=told.centring * fade, limit=told.limit, seen=round(AGE * sampling_rate), start=start
        )

    def _signal(self, sampling_rate: float, n: int) -> FloatArray:
        """(n,) signal of rms 1."""
        told = self.excitation
        if told.kind == "off" or told.rms == 0.0:
            return np.zeros(n)
        shape = {name: getattr(told, name) for name in ("kind", "low", "high", "period", "steps", "seed")}
        return unit_signal(AxisExcitation(**shape, rms=1.0), sampling_rate, n)

    @property
    def words(self) -> str:
        """The experiment in words, for an axis that is driven in V."""
        return self.said(USUAL)

    def said(self, units: Units) -> str:
        """The experiment in words, in the units of an axis."""
        told, volt, parts = self.excitation, units.input, []
        if told.rms > 0.0 and told.kind in BANDED:
            parts.append(f"{told.kind} of {told.rms:.3g} {volt} rms from {told.low:.3g} to {told.high:.3g} Hz")
        elif told.rms > 0.0 and told.kind != "off":
            parts.append(f"{told.kind} of {told.rms:.3g} {volt}, each for {told.period:.3g} s")
        if told.slow > 0.0:
            parts.append(f"a slow sine of {told.slow:.3g} {volt} with a period of {told.slow_period:.3g} s")
        if told.offset != 0.0:
            held, place = told.offset / told.centring if told.centring else 0.0, readable(units.output)
            parts.append(f"held {place[0] * held:+.3g} {place[1]} from the start" if held else f"an offset of {told.offset:.3g} {volt}")
        return " and ".join(parts) or "nothing"
