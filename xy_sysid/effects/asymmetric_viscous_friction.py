"""Viscous friction that differs between the two directions."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def force(asymmetry: float, v: float, gain: float) -> float:
    """Force against the drive beyond the base's own drag v / gain, V; negative against the motion where it is less."""
    return asymmetry * abs(v) / gain


def guesses(scene: Scene) -> Iterator[Guess]:
    """The size of the speed, whatever its direction, in volts of the base's own drag."""
    v = scene.smooth(scene.velocity, 300.0)
    yield Guess(columns(abs(v) / scene.gain), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="asymmetric_viscous_friction",
    law="F = (1 + asymmetry sign(v)) v / gain, of which v / gain is the base's",
    meaning="seals, wipers and guides that drag more one way than the other",
    validity="each direction has one drag coefficient; drag that is mostly back-EMF has none of it",
    source="Janot, Gautier & Brunot, Data set and reference models of EMPS, Nonlinear System Identification Benchmarks 2019",
    category="force",
    parameters=(Parameter("asymmetry", "", -0.95, 0.95, 0.3, "part by which the drag forth is above and back below the mean", positive=False),),
    shows="error of one sign that grows with speed, forth and back; even harmonics",
    look_alikes=("asymmetric_friction", "constant_load"),
    experiment="constant speeds both ways, slow and fast: this difference between the two inputs grows with speed, that of a load stays",
    functions={"force": force},
    guesses=guesses,
    straight=True,
)
