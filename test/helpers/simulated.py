"""Recordings of the simulated machine, with other physics code and numerics."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings


def recorded(
    effect: str,
    seconds: float = 30.0,
    seed: int = 21,
    counts: float = 0.0,
    encoder_on: str = "motor",
    axes: tuple[str, ...] = ("x",),
    block: int = 20,
) -> Recording:
    """A copy for each caller; it is simulated once.

    counts: of the encoder, per revolution of 5 mm; 0 as the machine has it; encoder_on: motor or table; axes: of the table, x alone or both
    block: samples driven at once; more means less work
    """
    return copied(_simulated(effect, seconds, seed, counts, encoder_on, axes, block))


def copied(recording: Recording) -> Recording:
    """A copy with its own samples."""
    return replace(recording, voltage=recording.voltage.copy(), position=recording.position.copy())


@cache
def _simulated(effect: str, seconds: float, seed: int, counts: float, encoder_on: str, axes: tuple[str, ...], block: int) -> Recording:
    machine = Machine.from_file("rigid.yaml", seed)
    own: dict[str, object] = {"encoder_on": encoder_on, **({"counts_per_revolution": counts} if counts else {})}
    spec = replace(machine.spec, axes=tuple(replace(a, drive=a.drive.model_copy(update=own)) for a in machine.spec.axes if a.name in axes))
    machine = Machine(spec, seed if own == {"encoder_on": "motor"} else None)
    machine = with_effects(machine, effect.split("+")) if effect else machine
    excited = {axis: AxisExcitation(seed=seed + k) for k, axis in enumerate(machine.axes)}
    settings = ExcitationSettings(lockstep=True, speed=0.0, block=block, ahead=max(1, 60 // block), axes=excited)
    return drive(machine, settings, seconds, lambda _: None)
