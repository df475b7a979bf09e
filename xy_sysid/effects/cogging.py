"""Cogging: a force that varies sinusoidally with position."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns, wave

PARTS = (0.5, 0.75, 1.1, 1.6)  # periods within the travel, of waves too long to repeat there
LEAST = 0.5  # least periods within the travel: with less, a wave is a softening spring


@law
def force(amplitude: float, period: float, phase: float, x: float) -> float:
    """Force against the drive at ``x``, V."""
    return amplitude * math.sin(2.0 * math.pi * x / period + phase)


def guesses(scene: Scene) -> Iterator[Guess]:
    """Sine and cosine at the periods of the missing force along the travel; and at longer periods, which are used only for starts of
    base and effect together: with a fixed base they would explain anything, as polynomials do."""
    missing = scene.missing_force()
    for period in scene.periods(missing, np.ones_like(missing)):
        yield _wave(scene, period)
    travel = float(np.ptp(scene.position))
    for part in PARTS if travel > 0.0 else ():
        yield _wave(scene, travel / part, inverse_only=True)


def _wave(scene: Scene, period: float, inverse_only: bool = False) -> Guess:
    angle = 2.0 * math.pi * scene.position / period
    return Guess(columns(np.sin(angle), np.cos(angle)), partial(wave, period), inverse_only)


def refusal(values: Sequence[float], between: tuple[float, float]) -> str:
    """Rejects a wave with less than ``LEAST`` periods within the travel."""
    seen = (between[1] - between[0]) / values[1]
    return f"only {seen:.2g} of its period are within the travel, at least {LEAST:g} are needed" if seen < LEAST else ""


EFFECT = Effect(
    name="cogging",
    law="F = amplitude sin(2 pi x / period + phase)",
    meaning="magnets against slots, and the current sensor's ripple",
    validity=f"at least {LEAST:g} periods within the travel (with less it looks like a softening spring), better 3; one harmonic",
    source="Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed., 2003, ch. 5",
    category="force",
    parameters=(
        Parameter("amplitude", "V", 1e-6, 100.0, 0.15, "input that overcomes it"),
        Parameter("period", "m", 1e-5, 10.0, 2.5e-3, "length of one period"),
        Parameter("phase", "rad", -100.0, 100.0, 0.0, "phase at x = 0", positive=False),
    ),
    shows="error repeats along the travel, with the same force at all speeds",
    look_alikes=("lead_error", "position_dependent_gain", "return_spring"),
    experiment="a slow traverse: the force error of cogging stays the same, that of a lead error shrinks with speed",
    functions={"force": force},
    guesses=guesses,
    refusal=refusal,
    suspects=("return_spring", "hardening_stiffness"),
)
