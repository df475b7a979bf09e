"""The score of a model on data: the likelihood of its error, which encoder noise and unmodelled causes produce.

The spectrum of the error in velocity is S(f) = N(f) + |G(f)|^2 s + v. N is the floor of the data and G the machine's measured response to a force at
the motor, which acts like the input: both are the same for all models, so no model can lower the weight of its own error. The power s of an
unmodelled force and the power v of an unmodelled motion, both white, are estimated for each model.
If both are small this is output error in units of the noise; if v is large it is unweighted output error, and if s is large it is
inverse dynamics (Ljung, System Identification, 2nd ed., sec. 3.2 and 10.1). The terms are Whittle's (1953): ln S + P / S for each line of
each window.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from xy_sysid.greybox.floor import Floor
from xy_sysid.samples.block import FloatArray

ROUNDS = 100  # most multiplicative updates
SETTLED = 1e-4  # relative change of both powers that ends them


@dataclass(frozen=True)
class Objective:
    """Scores errors by band.

    floor: (bands,) N, m^2/s^2; lines: (bands,) number of lines that count, 0 in bands without excitation; response: (bands,) |G|^2, (m/s/V)^2
    """

    floor: FloatArray
    lines: FloatArray
    response: FloatArray

    @staticmethod
    def of(floor: Floor) -> Objective:
        """The objective for a floor; if no band is excited, all count."""
        used = floor.excited if bool(np.any(floor.excited)) else np.ones_like(floor.excited)
        return Objective(np.maximum(floor.power, 1e-300), floor.lines * used, floor.response)

    @cached_property
    def count(self) -> float:
        """Number of lines that count."""
        return float(np.sum(self.lines))

    def unmodelled(self, power: FloatArray) -> tuple[float, float]:
        """(s, v): powers of the unmodelled force, V^2, and motion, m^2/s^2, with the highest likelihood for an error of this power (bands,)."""
        if not np.all(np.isfinite(power[self.lines > 0.0])):
            return 0.0, 0.0
        force, motion = likeliest(self.floor, power, self.response, self.lines)
        return float(force), float(motion)

    def spectrum(self, power: FloatArray) -> FloatArray:
        """(bands,) S, m^2/s^2, with the most likely unmodelled force and motion."""
        force, motion = self.unmodelled(power)
        return np.asarray(self.floor + force * self.response + motion)

    def each(self, powers: FloatArray, spectrum: FloatArray) -> FloatArray:
        """(windows,) nats of each half-overlapping window's power (windows, bands), above those of an error at the floor."""
        with np.errstate(over="ignore", invalid="ignore"):  # a diverging model
            found = 0.5 * (np.log(spectrum / self.floor) + powers / spectrum - 1.0) @ self.lines
        return np.where(np.isfinite(found), found, np.inf)

    def score(self, power: FloatArray, spectrum: FloatArray) -> float:
        """The same for a mean power (bands,), nats a line."""
        return float(self.each(power[None, :], spectrum)[0]) / max(0.5 * self.count, 1.0)

    def nats(self, score: float, windows: int) -> float:
        """A score, nats a line, summed over all lines of half-overlapping windows, half of which are independent."""
        return 0.5 * self.count * score * windows

    def of_power(self, power: FloatArray) -> float:
        """Score of an error's power (bands,), nats a line, with its most likely unmodelled force and motion."""
        return self.score(power, self.spectrum(power))

    def forced(self, spectrum: FloatArray) -> float:
        """Effective number of lines of a window in which unmodelled force and motion exceed the floor."""
        return float(self.lines @ (1.0 - self.floor / spectrum) ** 2)


@njit(cache=True)
def likeliest(floor: FloatArray, power: FloatArray, response: FloatArray, lines: FloatArray) -> tuple[float, float]:
    """(s, v) of ``Objective.unmodelled``, by multiplicative updates of the Itakura-Saito divergence (Fevotte, Bertin & Durrieu 2009, sec. 2.3)."""
    force = motion = 0.0
    for k in range(floor.size):
        if lines[k] > 0.0:
            beyond = max(power[k] - floor[k], 1e-6 * floor[k])
            motion = max(motion, 0.5 * beyond)
            force = max(force, 0.5 * beyond / max(response[k], 1e-300))
    for _ in range(ROUNDS):
        up_force = down_force = up_motion = down_motion = 0.0
        for k in range(floor.size):
            if lines[k] > 0.0:
                spectrum = floor[k] + force * response[k] + motion
                weight = lines[k] / spectrum
                ratio = power[k] / spectrum
                up_force += weight * response[k] * ratio
                down_force += weight * response[k]
                up_motion += weight * ratio
                down_motion += weight
        if down_motion <= 0.0:
            return 0.0, 0.0
        by_force = up_force / down_force if down_force > 0.0 else 0.0
        by_motion = up_motion / down_motion
        force, motion = force * by_force, motion * by_motion
        if abs(by_force - 1.0) < SETTLED and abs(by_motion - 1.0) < SETTLED:
            break
    return force, motion
