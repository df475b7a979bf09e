"""A joint under a position controller, with load and encoder noise: the truth for closed-loop identification.

J y'' + c y' = u + load, the effort held between samples; the controller measures the noisy position: u = stiffness (r - y) - damping dy/dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

JOINT = IdentifierSettings(
    response="joint_input_output",
    length=1024,
    band_low=0.5,
    band_high=50.0,
    min_coherence=0.1,
    numerator_order=0,
    denominator_order=2,
)
H1 = JOINT.model_copy(update={"response": "h1"})


@dataclass(frozen=True)
class Servo:
    """Inertia kg m2, drag N m s/rad, controller N m/rad and N m s/rad; rms of load (N m) and encoder (rad), white from sample to sample."""

    rate: float = 500.0
    inertia: float = 0.01
    drag: float = 0.08
    stiffness: float = 40.0
    damping: float = 1.0
    load: float = 0.6
    encoder: float = 5e-5

    def held(self) -> tuple[FloatArray, FloatArray]:
        """(numerator, denominator) of the sampled joint, effort held."""
        a, step = self.drag / self.inertia, 1.0 / self.rate
        decay = np.exp(-a * step)
        gain = 1.0 / self.inertia / a**2
        numerator = gain * np.array([0.0, a * step - 1 + decay, 1 - decay - a * step * decay])
        return numerator, np.array([1.0, -1 - decay, decay])

    def response(self, frequency: FloatArray) -> FloatArray:
        """(m,) complex, exact at the samples, rad/(N m)."""
        return np.asarray(signal.freqz(*self.held(), worN=frequency, fs=self.rate)[1])

    def run(self, reference: FloatArray, seed: int = 1) -> Recording:
        """The recording for a reference, (n,) rad."""
        random = np.random.default_rng(seed)
        (_, b1, b2), (_, a1, a2) = self.held()
        load = self.load * random.standard_normal(reference.size)
        noise = self.encoder * random.standard_normal(reference.size)
        effort, place = np.zeros(reference.size), np.zeros(reference.size)
        drive, before = np.zeros(2), np.zeros(2)  # effort with load, and true position, of the last two samples
        for k in range(reference.size):
            true = b1 * drive[0] + b2 * drive[1] - a1 * before[0] - a2 * before[1]
            place[k] = true + noise[k]
            effort[k] = self.stiffness * (reference[k] - place[k]) - self.damping * self.rate * (place[k] - (place[k - 1] if k else place[k]))
            drive, before = np.array([effort[k] + load[k], drive[0]]), np.array([true, before[0]])
        seq = np.arange(reference.size)
        return Recording(
            sampling_rate=self.rate,
            axes=("x",),
            seq=seq,
            time=seq / self.rate,
            voltage=effort[:, None],
            position=place[:, None],
            input_unit="N m",
            output_unit="rad",
            reference=reference[:, None],
        )


def multisine(rate: float, period: int, periods: int, high: float, rms: float, seed: int = 3) -> FloatArray:
    """(period * periods,) random phases on every line up to ``high`` Hz."""
    lines = np.arange(1, int(high * period / rate))
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, lines.size)
    one = np.sum(np.cos(2 * np.pi * np.outer(np.arange(period), lines) / period + phase), axis=1)
    return np.tile(one * rms / np.std(one), periods)
