"""The motor constant changes along the travel."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns, wave
from xy_sysid.samples.block import FloatArray


@law
def force(depth: float, period: float, phase: float, u: float, v: float, x: float, gain: float) -> float:
    """Loss of drive voltage plus increase of back-EMF at ``x``, V."""
    factor = 1.0 + depth * math.sin(2.0 * math.pi * x / period + phase)
    return (1.0 - factor) * u + (factor * factor - 1.0) * v / gain


def guesses(scene: Scene) -> Iterator[Guess]:
    """Sine and cosine, times the signal that a change of the motor constant multiplies, at the periods of the missing force over it."""
    base = 2.0 * scene.velocity / scene.gain - scene.voltage
    for period in scene.periods(scene.missing_force() * base, base * base):
        angle = 2.0 * math.pi * scene.position / period
        yield Guess(columns(np.sin(angle) * base, np.cos(angle) * base), partial(_read, period))


def _read(period: float, c: FloatArray) -> tuple[float, ...]:
    """(depth, period, phase) from the coefficients of sine and cosine."""
    depth, _, phase = wave(period, c)
    return (min(max(depth, 1e-3), 0.8), period, phase)


EFFECT = Effect(
    name="position_dependent_gain",
    law="u_eff = k u - (k^2 - 1) v / gain; k = 1 + depth sin(2 pi x / period + phase)",
    meaning="a linear motor's uneven magnets: force and back-EMF share one constant",
    validity="at least 3 periods within the travel; the pole is mostly back-EMF",
    source="Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed., 2003, ch. 4",
    category="force",
    parameters=(
        Parameter("depth", "", 1e-6, 0.9, 0.1, "largest relative change"),
        Parameter("period", "m", 1e-4, 10.0, 0.03, "length of one period"),
        Parameter("phase", "rad", -100.0, 100.0, 0.0, "phase at x = 0", positive=False),
    ),
    shows="error repeats along the travel, in proportion to the input",
    look_alikes=("cogging", "lead_error"),
    experiment="a slow traverse at no load: it still shows cogging; a change of the gain shows only at larger input",
    functions={"force": force},
    guesses=guesses,
)
