"""Drag that grows with the square of speed."""

from __future__ import annotations

import math
from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns

LEAST = 1e-3  # V/(m/s)2: lower bound, and start value if the trace has the wrong sign


@law
def force(coefficient: float, v: float, gain: float) -> float:
    """Force against the drive, V; it takes the sign of the gain."""
    return math.copysign(coefficient, gain) * abs(v) * v


def guesses(scene: Scene) -> Iterator[Guess]:
    """The square of the speed, with its sign."""
    v = scene.smooth(scene.velocity, 300.0)
    yield Guess(columns(math.copysign(1.0, scene.gain) * abs(v) * v), lambda c: (max(float(c[0]), LEAST),))


EFFECT = Effect(
    name="quadratic_drag",
    law="F = coefficient |v| v",
    meaning="fans, propellers and wheels in air, oil pushed through gaps, air under a bellows",
    validity="turbulent flow: fast motion; negligible at crawling speed",
    source="Worden & Tomlinson, Nonlinearity in Structural Dynamics, 2001, sec. 2.2.5",
    category="force",
    parameters=(Parameter("coefficient", "V/(m/s)2", LEAST, 1e5, 40.0, "input that overcomes it, per square of the speed"),),
    shows="an error opposed to the motion, which grows faster than speed; the gain looks smaller at large amplitude",
    look_alikes=("viscous_friction", "saturation", "coulomb_friction"),
    experiment="constant speeds both ways: the input needed is a parabola over speed",
    functions={"force": force},
    guesses=guesses,
)
