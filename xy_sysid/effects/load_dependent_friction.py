"""Load-dependent friction: dry friction that grows with the effort that a gear transmits.

It is a level of dry friction and not a force of its own: with Coulomb friction an axis then sticks up to the sum of both levels, and reversals are
located in time. Alone it never holds an axis against its drive, because ``share`` is below 1.

The effort is the input itself. Without the drag, u - v / gain, it would be proportional to the acceleration, and most data would not
distinguish its friction from a change of the inertia.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def level(share: float, u: float) -> float:
    """Size of the friction under the input ``u``, V."""
    return share * abs(u)


def guesses(scene: Scene) -> Iterator[Guess]:
    """The size of the input, in the direction of motion."""
    yield Guess(columns(math.copysign(1.0, scene.gain) * scene.direction() * abs(scene.voltage)), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="load_dependent_friction",
    law="F = share |u| sign(v); at rest it holds up to share |u|",
    meaning="teeth of a gear, a worm or a harmonic drive, threads of a lead screw: the more they transmit, the more friction they have",
    validity="a current, torque or force as input, or a voltage much larger than the back-EMF; a rotor with little inertia compared with its load",
    source="Duclusaud, Passault, Padois & Ly, Extended friction models for the physics simulation of servo actuators, arXiv:2410.08650, 2024",
    category="friction",
    parameters=(Parameter("share", "", 1e-3, 0.9, 0.15, "friction as a fraction of the input"),),
    shows="an error as with Coulomb friction, but the same fraction of the motion at every amplitude",
    look_alikes=("coulomb_friction", "quadratic_drag", "saturation"),
    experiment="the same input at small and large amplitude: the response stays the same, where Coulomb friction and saturation change it",
    functions={"level": level},
    guesses=guesses,
)
