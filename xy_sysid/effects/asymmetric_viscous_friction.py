"""Viscous friction that differs between the two directions."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def force(asymmetry: float, v: float, gain: float) -> float:
    """Force against the drive in addition to the base's own drag v / gain, V."""
    return asymmetry * abs(v) / gain


def guesses(scene: Scene) -> Iterator[Guess]:
    """The magnitude of the velocity, in volts of the base's own drag."""
    v = scene.smooth(scene.velocity, 300.0)
    yield Guess(columns(abs(v) / scene.gain), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="asymmetric_viscous_friction",
    law="F = asymmetry sign(v) v / gain, in addition to the drag v / gain of the base",
    meaning="seals, wipers and guides with more drag in one direction than in the other",
    validity="each direction has one drag coefficient; back-EMF, often most of the drag, has no asymmetry",
    source="Janot, Gautier & Brunot, Data set and reference models of EMPS, Nonlinear System Identification Benchmarks 2019",
    category="force",
    parameters=(
        Parameter("asymmetry", "", -0.95, 0.95, 0.3, "relative difference of each direction from the mean; positive: larger forth", positive=False),
    ),
    shows="an error with the same sign forth and back, which grows with speed; even harmonics",
    look_alikes=("asymmetric_friction", "constant_load"),
    experiment="constant speeds both ways, slow and fast: the difference between the inputs grows with speed; with a load it stays the same",
    functions={"force": force},
    guesses=guesses,
    straight=True,
)
