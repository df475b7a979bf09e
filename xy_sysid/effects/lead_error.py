"""Lead error: a periodic error of the screw or the scale."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns, wave

STEEPEST = 0.2  # change of the reading over the motion that no encoder has


@law
def error(amplitude: float, period: float, phase: float, x: float) -> float:
    """Encoder reading minus position at ``x``, m."""
    return amplitude * math.sin(2.0 * math.pi * x / period + phase)


def guesses(scene: Scene) -> Iterator[Guess]:
    """Sine and cosine at the periods of the relative velocity error along the travel."""
    v = scene.velocity
    e = scene.smooth(scene.error, 300.0)
    for period in scene.periods(e * v, v * v):
        angle = 2.0 * math.pi * scene.position / period
        rate = 2.0 * math.pi / period * v
        yield Guess(columns(rate * np.cos(angle), -rate * np.sin(angle)), partial(wave, period))


def refusal(values: Sequence[float], between: tuple[float, float]) -> str:
    """Rejects a slope of STEEPEST or more, and less than half a period within the travel: such an error could explain any signal."""
    slope, repeats = 2.0 * math.pi * values[0] / values[1], (between[1] - between[0]) / values[1]
    if slope >= STEEPEST:
        return f"the reading would change by {100 * slope:.3g} % more or less than the motion: no encoder does that"
    return "" if repeats >= 0.5 else f"only {repeats:.2g} of its periods are within the travel, so the data do not show whether it repeats"


EFFECT = Effect(
    name="lead_error",
    law="y = x + amplitude sin(2 pi x / period + phase)",
    meaning="wobble of the screw, or an encoder disk off centre",
    validity="at least 3 periods within the travel; small compared with the period",
    source="ISO 3408-3:2006, travel deviation within one revolution",
    category="encoder",
    parameters=(
        Parameter("amplitude", "m", 1e-9, 1e-2, 8e-6, "largest error"),
        Parameter("period", "m", 1e-5, 10.0, 0.01, "length of one period"),
        Parameter("phase", "rad", -100.0, 100.0, 0.0, "phase where the encoder shows 0", positive=False),
    ),
    shows="error repeats along the travel and grows with speed",
    look_alikes=("cogging", "position_dependent_gain"),
    experiment="traverse at two speeds: the error in position is the same at both",
    functions={"error": error},
    guesses=guesses,
    refusal=refusal,
)
