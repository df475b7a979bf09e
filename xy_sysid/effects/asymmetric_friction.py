"""Dry friction that differs between the two directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from xy_sysid.effects._contract import Effect, Parameter, Sum, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray


@law
def level(asymmetry: float, coulomb: float, direction: float) -> float:
    """Size of the friction in one direction, V."""
    return coulomb * (1.0 + asymmetry * direction)


def guesses(scene: Scene) -> Iterator[Guess]:
    """The direction of motion, and its magnitude (0 at rest)."""
    direction = scene.direction()

    def read(c: FloatArray) -> tuple[float, ...]:
        even, odd = float(c[1]), max(float(c[0]), 1e-300)
        return (odd, min(max(even / odd, -0.95), 0.95))

    yield Guess(columns(direction, abs(direction)), read)


def joined(values: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """(coulomb, asymmetry) of a Coulomb level and a load."""
    (coulomb,), (load,) = values
    return coulomb, load / coulomb


def apart(values: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """The Coulomb level and the load; the inverse of ``joined``."""
    coulomb, asymmetry = values
    return (coulomb,), (asymmetry * coulomb,)


EFFECT = Effect(
    name="asymmetric_friction",
    law="F = coulomb (1 + asymmetry sign(v)) sign(v)",
    meaning="worn or tilted nut, one-sided wiper: more friction forth than back",
    validity="speeds well above breakaway; one level each way; without backlash equal to Coulomb friction with a constant load below its level",
    source="Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991, ch. 3",
    category="friction",
    parameters=(
        Parameter("coulomb", "V", 1e-6, 100.0, 0.2, "mean level"),
        Parameter("asymmetry", "", -0.99, 0.99, 0.5, "relative difference of each direction from the mean; positive: larger forth", positive=False),
    ),
    shows="the error differs between forth and back, and vanishes at rest",
    look_alikes=("constant_load", "coulomb_friction"),
    experiment="another mounting or payload: a load changes with gravity, a nut does not; without backlash one mounting cannot distinguish them",
    functions={"level": level},
    guesses=guesses,
    family="dry_friction",
    sum_of=Sum(("coulomb_friction", "constant_load"), joined, apart),
)
