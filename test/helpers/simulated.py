"""Recordings of the simulated machine, whose physics and numerics are others."""

from __future__ import annotations

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings


def recorded(effect: str, seconds: float = 30.0, seed: int = 21) -> Recording:
    machine = Machine.from_file("rigid.yaml", seed)
    machine = with_effects(machine, effect.split("+")) if effect else machine
    axes = {axis: AxisExcitation(seed=seed + k) for k, axis in enumerate(machine.axes)}
    return drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes=axes), seconds, lambda _: None)
