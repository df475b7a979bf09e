"""Recordings of the simulated machine, whose physics and numerics are others."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings


@cache
def recorded(
    effect: str, seconds: float = 30.0, seed: int = 21, counts: float = 0.0, encoder_on: str = "motor", axes: tuple[str, ...] = ("x",)
) -> Recording:
    """Simulated once for all who ask, so its arrays are read-only.

    counts: of the encoder, per revolution of 5 mm; 0 as the machine has it; encoder_on: motor or table; axes: of the table, x alone or both.
    """
    machine = Machine.from_file("rigid.yaml", seed)
    own: dict[str, object] = {"encoder_on": encoder_on, **({"counts_per_revolution": counts} if counts else {})}
    spec = replace(machine.spec, axes=tuple(replace(a, drive=a.drive.model_copy(update=own)) for a in machine.spec.axes if a.name in axes))
    machine = Machine(spec, seed if own == {"encoder_on": "motor"} else None)
    machine = with_effects(machine, effect.split("+")) if effect else machine
    excited = {axis: AxisExcitation(seed=seed + k) for k, axis in enumerate(machine.axes)}
    recording = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, block=100, ahead=1, axes=excited), seconds, lambda _: None)
    for array in (recording.seq, recording.time, recording.voltage, recording.position):
        array.setflags(write=False)
    return recording
