"""Saturation: the output of the amplifier is limited."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray


@law
def output(limit: float, u: float) -> float:
    """Clipped voltage, V."""
    return min(max(u, -limit), limit) if limit > 0.0 else u


def guesses(scene: Scene) -> Iterator[Guess]:
    """The voltage beyond a limit, for limits that the highest 0.1 to 90 % of the magnitudes exceed."""
    u = scene.voltage
    for limit in np.quantile(np.abs(u), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.92, 0.96, 0.98, 0.99, 0.997, 0.999]):
        above = u - np.clip(u, -limit, limit)
        yield Guess(columns(above), partial(_read, float(limit)), whole=True)


def _read(limit: float, _: FloatArray) -> tuple[float, ...]:
    """The tested limit."""
    return (limit,)


EFFECT = Effect(
    name="saturation",
    law="u_eff = clip(u, -limit, limit)",
    meaning="supply or current limit of the drive",
    validity="the same limit on both sides, without memory",
    source="Khalil, Nonlinear Systems, 3rd ed., sec. 1.2.7",
    category="input",
    parameters=(Parameter("limit", "V", 1e-3, 1e6, 1.5, "largest output"),),
    shows="error only where the input is large, against its sign",
    look_alikes=("gain_drift",),
    experiment="stronger excitation: an input that never reaches the limit cannot show it",
    functions={"output": output},
    guesses=guesses,
    order=10,
)
