"""Gain drift: the gain of the drive changes linearly with time."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns

LIMIT = 0.9  # largest relative change: warming up neither stops a drive nor doubles its gain


@law
def output(rate: float, u: float, t: float) -> float:
    """The voltage with the gain at time ``t``, V."""
    return u * (1.0 + min(max(rate * t, -LIMIT), LIMIT))


def guesses(scene: Scene) -> Iterator[Guess]:
    """Voltage times time."""
    yield Guess(columns(-scene.voltage * scene.time), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="gain_drift",
    law="u_eff = u (1 + rate t)",
    meaning="magnets and amplifier warm up",
    validity="slow and linear within the recording",
    source="Krishnan, Permanent Magnet Synchronous and Brushless DC Motor Drives, CRC 2010, sec. 1.3 (remanence -0.1 %/K)",
    category="input",
    parameters=(Parameter("rate", "1/s", -1.0, 1.0, -0.002, "change of the gain per second, as a part of it", positive=False),),
    shows="error grows towards both ends of the recording, in proportion to the input",
    look_alikes=("saturation",),
    experiment="record again, warm from the start: the drift is gone or smaller",
    functions={"output": output},
    guesses=guesses,
    order=20,
)
