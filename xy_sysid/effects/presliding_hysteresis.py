"""Before it slides, friction is a spring that forgets."""

from __future__ import annotations

import math
from collections.abc import Iterator

from xy_sysid.effects.contract import Effect, Parameter, law
from xy_sysid.effects.scene import Guess, Scene, columns


@law
def bend(coulomb: float, length: float, bristle: float, v: float, h: float, level: float) -> float:
    """Deflection after ``h`` s at the constant speed ``v``, m: the exact solution, so no step is too long."""
    if v == 0.0:
        return bristle
    slide = length * (coulomb + level) / coulomb
    end = slide if v > 0.0 else -slide
    return end + (bristle - end) * math.exp(-abs(v) * h / slide)


@law
def force(coulomb: float, length: float, damping: float, bristle: float, v: float, level: float) -> float:
    """Spring and damper of the bristles, V."""
    slide = length * (coulomb + level) / coulomb
    return coulomb / length * bristle + damping * (v - abs(v) * bristle / slide)


def guesses(scene: Scene) -> Iterator[Guess]:
    """The direction of motion; 10 um to begin with."""
    yield Guess(columns(scene.direction()), lambda c: (max(float(c[0]), 1e-2), 10e-6, 2.0))


EFFECT = Effect(
    name="presliding_hysteresis",
    law="z' = v - |v| z / length; F = coulomb z / length + damping z'",
    meaning="asperities bend before they break: micrometre loops around each reversal; all dry friction goes through them",
    validity="loops that do not drift; other dry friction in the model scales the sliding level",
    source="C. Canudas de Wit et al., A new model for control of systems with friction, IEEE TAC 40 (1995), eq. 1-3",
    category="bristle",
    parameters=(
        Parameter("coulomb", "V", 1e-5, 100.0, 0.25, "level when sliding"),
        Parameter("length", "m", 5e-7, 1e-2, 10e-6, "deflection at which the bristles slide"),
        Parameter("damping", "V/(m/s)", 1e-3, 1e3, 2.0, "damping of the bristles"),
    ),
    shows="as Coulomb friction, with a spring around each reversal: loops over micrometres, a resonance at small amplitude",
    look_alikes=("coulomb_friction", "stribeck_friction"),
    experiment="small amplitudes that never slide: force against position is a spring, not a step",
    functions={"bend": bend, "force": force},
    guesses=guesses,
    states=("bristle",),
    family="dry_friction",
)
