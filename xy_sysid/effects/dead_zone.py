"""Dead zone: small commands have no effect."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray


@law
def output(width: float, u: float) -> float:
    """The voltage behind the dead zone, V."""
    return u - min(max(u, -width), width)


def guesses(scene: Scene) -> Iterator[Guess]:
    """The voltage clipped to the zone, for half widths of 3 to 100 % of its standard deviation."""
    u = scene.voltage
    for width in np.geomspace(0.03, 1.0, 8) * float(np.std(u)):
        yield Guess(columns(np.clip(u, -width, width)), partial(_read, float(width)), whole=True)


def _read(width: float, c: FloatArray) -> tuple[float, ...]:
    """The width from the coefficient of a tested width, to which it is proportional to first order."""
    return (width * max(float(c[0]), 0.1),)


EFFECT = Effect(
    name="dead_zone",
    law="u_eff = u - clip(u, -width, width)",
    meaning="amplifier cross-over, valve overlap, a threshold in the drive",
    validity="the same width on both sides; acts on the command, whatever the motion",
    source="Tao & Kokotovic, Adaptive Control of Systems with Actuator Nonlinearities, Wiley 1996, sec. 2.1",
    category="input",
    parameters=(Parameter("width", "V", 1e-6, 100.0, 0.15, "half of the zone"),),
    shows="error follows the sign of the input, not of the motion",
    look_alikes=("coulomb_friction",),
    experiment="fast excitation separates the sign of the input from the sign of the velocity; at constant input they look the same",
    functions={"output": output},
    guesses=guesses,
)
