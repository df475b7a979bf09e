"""Return spring: a spring towards a rest position, which may soften."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns

LEAST = 0.05  # V/m on the reference machine: least start value of the stiffness


@law
def force(stiffness: float, rest: float, softening: float, x: float, gain: float) -> float:
    """Force towards the rest position at ``x``, V; it takes the sign of the gain."""
    stretched = x - rest
    return math.copysign(stiffness, gain) * stretched * (1.0 - softening * stretched * stretched)


def guesses(scene: Scene) -> Iterator[Guess]:
    """A linear spring with its preload; and position and its cube relative to the middle of the travel."""
    x, way = scene.position, math.copysign(1.0, scene.gain)
    least = LEAST * scene.similar.factor("V/m")
    yield Guess(columns(way * x, np.full_like(x, way)), lambda c: (max(float(c[0]), least), -float(c[1]) / max(float(c[0]), least), 0.0))
    middle = 0.5 * sum(scene.ends)
    far = x - middle
    yield Guess(columns(way * far, way * far**3), lambda c: (max(float(c[0]), least), middle, -float(c[1]) / max(float(c[0]), least)))


def refusal(values: Sequence[float], between: tuple[float, float]) -> str:
    """Rejects a force that falls with distance within the travel: that is part of a wave, not a spring."""
    _, rest, softening = values
    gives_way = 3.0 * softening * max((place - rest) ** 2 for place in between) >= 1.0
    return "its force would fall with distance within the travel, unlike that of a spring" if gives_way else ""


EFFECT = Effect(
    name="return_spring",
    law="F = stiffness d (1 - softening d^2), d = x - rest",
    meaning="a return or torsion spring of a valve, throttle, flexure or joint; a rubber bush, which softens",
    validity="the coils do not touch; far below the collapse of a softening spring: softening d^2 < 1/3",
    source="Kovacic & Brennan, The Duffing Equation, 2011, sec. 1.2 (linear, softening and hardening restoring forces)",
    category="force",
    parameters=(
        Parameter("stiffness", "V/m", 1e-6, 1e7, 10.0, "input that holds it, per distance (per rad where the position is an angle)"),
        Parameter("rest", "m", -1e4, 1e4, 0.0, "rest position of the spring; far outside the travel if it is preloaded", positive=False),
        Parameter("softening", "1/m2", -1e6, 1e6, 100.0, "part of the stiffness lost per distance squared; below 0 it stiffens", positive=False),
    ),
    shows="the axis returns by itself; the response is flat below a low frequency; error with the sign of the position",
    look_alikes=("hardening_stiffness", "gravity", "constant_load", "cogging"),
    experiment="hold the axis at several positions over the whole travel: the input needed follows the law",
    functions={"force": force},
    guesses=guesses,
    refusal=refusal,
    family="spring",
    suspects=("hardening_stiffness",),
    on_table=True,
)
