"""Amplifier lag: the current follows the command with a first-order lag."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
import scipy

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray


@law
def advance(lag: float, current: float, u: float, h: float) -> tuple[float, float]:
    """(mean over the sub-step, value at its end) of the lagging voltage, V; exact for the constant ``u``."""
    left = math.exp(-h / lag)
    end = u + (current - u) * left
    return u + (current - u) * lag / h * (1.0 - left), end


def guesses(scene: Scene) -> Iterator[Guess]:
    """Voltage minus lagged voltage, for lags of 0.2 to 5 ms; longer if the sampling is slow."""
    for lag in np.geomspace(0.2e-3, 5e-3, 6) * scene.similar.time:
        left = math.exp(-1.0 / (float(lag) * scene.sampling_rate))
        behind = scipy.signal.lfilter([1.0 - left], [1.0, -left], scene.voltage)
        yield Guess(columns(scene.voltage - behind), partial(_read, float(lag)), whole=True)


def joint(scene: Scene) -> Iterator[tuple[float, float, float, tuple[float, ...]]]:
    """The same base with its delay reduced by the lag, because a fit without the lag counts it as delay."""
    for lag in np.geomspace(0.2e-3, 3.2e-3, 5) * scene.similar.time:
        yield scene.gain, -float(lag), scene.pole, (float(lag),)


def _read(lag: float, c: FloatArray) -> tuple[float, ...]:
    """The lag from the coefficient of a tested lag."""
    return (lag * min(max(float(c[0]), 0.3), 3.0),)


EFFECT = Effect(
    name="amplifier_lag",
    law="lag u_eff' + u_eff = u",
    meaning="motor inductance over resistance, filter of the command input",
    validity="one time constant; the current loop is not in its limit",
    source="Krishnan, Electric Motor Drives, Prentice Hall 2001, sec. 2.3",
    category="state",
    parameters=(Parameter("lag", "s", 1e-5, 1.0, 1e-3, "time constant"),),
    shows="a further fall of 20 dB per decade at high frequency, with its phase",
    look_alikes=("time_delay", "viscous_friction"),
    experiment="excite to a higher frequency; measure the motor current",
    functions={"advance": advance},
    guesses=guesses,
    joint=joint,
    states=("current",),
)
