"""Stribeck friction: dry friction that falls with speed from its breakaway level."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray


@law
def level(excess: float, coulomb: float, velocity: float, v: float) -> float:
    """Size of the friction at speed ``v``, V."""
    ratio = v / velocity
    return coulomb + excess * math.exp(-ratio * ratio)


def guesses(scene: Scene) -> Iterator[Guess]:
    """The direction of motion, at all speeds and near rest, for Stribeck speeds of 2 to 500 % of the velocity's standard deviation.

    Above 100 % the trace resembles drag, and with an inaccurate fixed base it would explain too much.
    """
    direction, v = scene.direction(), scene.smooth(scene.velocity, 300.0)
    usual = float(np.std(v))
    for velocity in np.concatenate((np.geomspace(0.02, 1.0, 8), np.geomspace(1.7, 5.0, 3))) * usual:
        near = direction * np.exp(-((v / velocity) ** 2))
        yield Guess(columns(near, direction), partial(_read, float(velocity)), inverse_only=bool(velocity > usual))


def _read(velocity: float, c: FloatArray) -> tuple[float, ...]:
    """(coulomb, excess, velocity) from the coefficients at one Stribeck speed."""
    return (float(c[1]), float(c[0]), velocity)


EFFECT = Effect(
    name="stribeck_friction",
    law="F = (coulomb + excess exp(-(v / velocity)^2)) sign(v); at rest it holds up to coulomb + excess",
    meaning="boundary lubrication breaks down as the film builds up: stick-slip at crawling speed",
    validity="steady film; no memory at reversals (presliding) and no frictional lag",
    source="Armstrong-Helouvry, Dupont & Canudas de Wit, A survey of friction models, Automatica 30 (1994), eq. 6",
    category="friction",
    parameters=(
        Parameter("coulomb", "V", 1e-6, 100.0, 0.15, "level at speed"),
        Parameter("excess", "V", 1e-6, 100.0, 0.2, "breakaway above the Coulomb level"),
        Parameter("velocity", "m/s", 1e-5, 1.0, 0.01, "speed at which the excess has fallen to 1/e"),
    ),
    shows="as Coulomb friction, with more error at crawling speed than above it",
    look_alikes=("coulomb_friction", "presliding_hysteresis"),
    experiment="slow reversals and constant crawling speeds: the force falls while speed rises",
    functions={"level": level},
    guesses=guesses,
    family="dry_friction",
)
