"""Presliding hysteresis: before it slides, friction acts as a spring with hysteresis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

LENGTHS = (0.015, 0.05, 0.15, 0.5)  # relative to the distance between two reversals
DAMPING = 0.075  # start value, relative to the standard deviation of the voltage over that of the velocity


@law
def bend(coulomb: float, length: float, bristle: float, v: float, h: float, level: float) -> float:
    """Deflection after ``h`` s at the constant speed ``v``, m: the exact solution, for steps of any length."""
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
    """Deflection of bristles in the measured motion, for lengths up to half the distance between two reversals."""
    v, swing, usual = scene.smooth(scene.velocity, 300.0), scene.swing, float(np.std(scene.velocity))
    if not swing > 0.0:
        return
    damping = DAMPING * float(np.std(scene.voltage)) / usual
    for length in LENGTHS:
        yield Guess(columns(_deflection(v, 1.0 / scene.sampling_rate, length * swing)), partial(_read, length * swing, damping))


def _read(length: float, damping: float, c: FloatArray) -> tuple[float, ...]:
    """(coulomb, length, damping) from the coefficient at one length."""
    return (float(c[0]), length, damping)


@compiled
def _deflection(v: FloatArray, period: float, length: float) -> FloatArray:
    """(n,) deflection over length, -1..1, at the middle of samples with the mean speeds ``v``."""
    bristle, found = 0.0, np.empty(v.size)
    for i in range(v.size):
        middle = bend(1.0, length, bristle, v[i], 0.5 * period, 0.0)
        found[i] = middle / length
        bristle = bend(1.0, length, middle, v[i], 0.5 * period, 0.0)
    return found


EFFECT = Effect(
    name="presliding_hysteresis",
    law="z' = v - |v| z / length; F = coulomb z / length + damping z'",
    meaning="asperities bend before they break away: tiny loops around each reversal; all dry friction acts through them",
    validity="loops that do not drift; other dry friction in the model scales the sliding level",
    source="C. Canudas de Wit et al., A new model for control of systems with friction, IEEE TAC 40 (1995), eq. 1-3",
    category="bristle",
    parameters=(
        Parameter("coulomb", "V", 1e-5, 100.0, 0.25, "level when sliding"),
        Parameter("length", "m", 5e-7, 1e-2, 10e-6, "deflection at which the bristles slide"),
        Parameter("damping", "V/(m/s)", 1e-3, 1e3, 2.0, "damping of the bristles"),
    ),
    shows="as Coulomb friction, with a spring around each reversal: tiny loops, a resonance at small amplitude",
    look_alikes=("coulomb_friction", "stribeck_friction"),
    experiment="small amplitudes that never slide: force against position is a spring, not a step",
    functions={"bend": bend, "force": force},
    guesses=guesses,
    states=("bristle",),
    family="dry_friction",
)
