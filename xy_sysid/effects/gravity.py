"""Gravity: the weight of a joint's arm."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns

LEAST = 0.5  # least travel, rad: below it, a sine equals a load and a linear spring within 1.6 % of its amplitude


@law
def force(amplitude: float, phase: float, x: float, gain: float) -> float:
    """Force towards the hanging position at the angle ``x``, V; it takes the sign of the gain."""
    return math.copysign(amplitude, gain) * math.sin(x + phase)


def guesses(scene: Scene) -> Iterator[Guess]:
    """Sine and cosine of the position, an angle; none if the travel is too short to distinguish them from a load and a spring."""
    low, high = scene.ends
    way = math.copysign(1.0, scene.gain)
    if high - low >= LEAST:
        yield Guess(
            columns(way * np.sin(scene.position), way * np.cos(scene.position)),
            lambda c: (math.hypot(float(c[0]), float(c[1])), math.atan2(float(c[1]), float(c[0]))),
        )


EFFECT = Effect(
    name="gravity",
    law="F = amplitude sin(x + phase) = a sin(x) + b cos(x); x is the angle, rad",
    meaning="a joint that lifts its arm, a pendulum, a wheel out of balance",
    validity=f"x is an angle in rad, of a single joint whose load does not swing; travel of {LEAST:g} rad or more",
    source="Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, 2nd ed., 2020, sec. 6.4 (one link with gravity)",
    category="force",
    parameters=(
        Parameter("amplitude", "V", 1e-6, 1000.0, 0.5, "input that holds the arm level: mass, g and lever"),
        Parameter("phase", "rad", -100.0, 100.0, 0.0, "angle from where the arm hangs to the encoder's zero", positive=False),
    ),
    shows="error proportional to the sine of the angle, the same at all speeds and in both directions; a pendulum's resonance at low frequency",
    look_alikes=("return_spring", "hardening_stiffness", "constant_load", "cogging"),
    experiment="hold the axis at several angles around the turn: with gravity the input needed is a sine, with a spring it keeps rising",
    functions={"force": force},
    guesses=guesses,
    on_table=True,
    angular=True,
    special_of="cogging",
    suspects=("return_spring",),
)
