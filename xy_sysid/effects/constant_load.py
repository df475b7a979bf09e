"""Constant load: a force that does not change."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def force(load: float) -> float:
    """Force against the drive, V."""
    return load


def guesses(scene: Scene) -> Iterator[Guess]:
    """A constant force."""
    yield Guess(columns(np.ones_like(scene.voltage)), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="constant_load",
    law="F = load",
    meaning="a tilted axis, a hanging cable, a current offset of the amplifier",
    validity="the same at every place, speed and time",
    source="Janot, Gautier & Brunot, Data set and reference models of EMPS, 2019 (offset in the inverse model); Newton's second law",
    category="force",
    parameters=(Parameter("load", "V", -100.0, 100.0, 0.15, "input that holds it", positive=False, per_recording=True),),
    shows="the mean velocity differs from the model's; it drifts to one side",
    look_alikes=("asymmetric_friction", "hardening_stiffness"),
    experiment="constant speed both ways, and rest under small inputs of both signs",
    functions={"force": force},
    guesses=guesses,
    on_table=True,
)
