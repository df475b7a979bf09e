"""Viscous drag that changes along the travel."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def force(slope: float, v: float, x: float, gain: float) -> float:
    """Drag at ``x`` in addition to the base's own v / gain, V."""
    return slope * x * v / gain


def guesses(scene: Scene) -> Iterator[Guess]:
    """Position times speed, in volts of the base's own drag."""
    v = scene.smooth(scene.velocity, 300.0)
    yield Guess(columns(scene.position * v / scene.gain), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="position_dependent_drag",
    law="F = slope x v / gain, in addition to the drag v / gain of the base",
    meaning="a guide or screw that is not quite straight or parallel, preload that grows towards one end, grease on part of the travel",
    validity="drag that rises steadily from one end to the other and never below zero; drag that is largest in the middle is not detected",
    source="Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), sec. 2 (position-dependent friction)",
    category="force",
    parameters=(Parameter("slope", "1/m", -1e4, 1e4, 3.0, "relative change of the drag per distance along the travel", positive=False),),
    shows="error proportional to speed whose sign depends on position: too slow at one end, too fast at the other",
    look_alikes=("position_dependent_gain", "asymmetric_viscous_friction", "cogging"),
    experiment="constant speeds from end to end, both ways: the extra input grows with speed and position, and opposes the motion both ways",
    functions={"force": force},
    guesses=guesses,
)
