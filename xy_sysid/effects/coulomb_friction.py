"""Coulomb friction: dry friction of constant magnitude."""

from __future__ import annotations

from collections.abc import Iterator

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns


@law
def level(coulomb: float) -> float:
    """Size of the friction, V."""
    return coulomb


def guesses(scene: Scene) -> Iterator[Guess]:
    """The direction of motion."""
    yield Guess(columns(scene.direction()), lambda c: (float(c[0]),))


EFFECT = Effect(
    name="coulomb_friction",
    law="F = coulomb sign(v); at rest it holds up to coulomb",
    meaning="preloaded nut, guide seals and bearings",
    validity="speeds well above breakaway, motion well above the presliding range",
    source="Olsson et al., Friction models and friction compensation, Eur. J. Control 4 (1998), eq. 1",
    category="friction",
    parameters=(Parameter("coulomb", "V", 1e-6, 100.0, 0.2, "input that overcomes it, moving or at rest"),),
    shows="error follows the direction of motion; the gain looks smaller at small amplitude; odd harmonics",
    look_alikes=("stribeck_friction", "presliding_hysteresis", "dead_zone"),
    experiment="slow reversals show breakaway and tiny loops; constant speed shows that the level stays",
    functions={"level": level},
    guesses=guesses,
    family="dry_friction",
)
