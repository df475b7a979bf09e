"""A pole-zero pair on the sampled motion: what both resonances share.

Poles and zeros are mapped by z = exp(s / fs) (matched z-transform; Franklin, Powell & Workman, Digital Control of Dynamic
Systems, 3rd ed., sec. 6.2.3), with gain 1 at 0 Hz. As the pair lies close together, what the mapping does far above it
cancels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import scipy.signal

from xy_sysid.effects.contract import law
from xy_sysid.effects.scene import Guess, Scene, columns
from xy_sysid.stream import FloatArray

_DAMPING = 0.03  # of the first guess; real frames and screws have 0.01 to 0.1


@law
def polynomial(frequency: float, damping: float, fs: float) -> tuple[float, float]:
    """c1, c2 of z^2 + c1 z + c2 for an oscillation at ``frequency`` (Hz) with this damping ratio."""
    w = 2.0 * math.pi * frequency / fs
    decay = math.exp(-damping * w)
    under = 1.0 - damping * damping
    turn = math.cos(w * math.sqrt(under)) if under > 0.0 else math.cosh(w * math.sqrt(-under))
    return -2.0 * decay * turn, decay * decay


@law
def pair(zero: float, zero_damping: float, pole: float, pole_damping: float, fs: float) -> tuple[float, float, float, float, float]:
    """b0, b1, b2, a1, a2 of the section with zeros and poles at these frequencies (Hz)."""
    b1, b2 = polynomial(zero, zero_damping, fs)
    a1, a2 = polynomial(pole, pole_damping, fs)
    b0 = (1.0 + a1 + a2) / (1.0 + b1 + b2)
    return b0, b0 * b1, b0 * b2, a1, a2


def guesses(scene: Scene, low: float, high: float) -> Iterator[Guess]:
    """Traces of pairs with poles between ``low`` and ``high`` (Hz), every 6 per cent."""
    top = min(high, 0.35 * scene.sampling_rate)
    for frequency in np.geomspace(low, top, max(int(math.log(top / low) / 0.06), 2)):
        w = 2.0 * math.pi * float(frequency)
        bottom = [1.0, 2.0 * _DAMPING * w, w * w]
        traces = []
        for numerator in ([1.0, 0.0, 0.0], [0.0, w, 0.0]):
            b, a = scipy.signal.bilinear(numerator, bottom, scene.sampling_rate)
            traces.append(scipy.signal.lfilter(b, a, scene.velocity - scene.error))
        yield Guess(columns(*traces), _Reader(float(frequency)), at_encoder=True)


class _Reader:
    """(antiresonance, its damping, split, damping of the resonance) from the two coefficients of a pole at ``frequency``."""

    def __init__(self, frequency: float) -> None:
        self.frequency = frequency

    def __call__(self, c: FloatArray) -> tuple[float, ...]:
        stretch = max(1.0 + float(c[0]), 1.02)
        zero = self.frequency / math.sqrt(stretch)
        damping = (2.0 * _DAMPING + float(c[1])) / (2.0 * math.sqrt(stretch))
        return (self.frequency / zero - 1.0, zero, min(max(damping, 0.005), 0.2), _DAMPING)
