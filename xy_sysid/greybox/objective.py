"""One score of a model on data: the likelihood of its error, caused by the encoder's noise and by what the model does not have.

The spectrum of the error in velocity is S(f) = N(f) + |G(f)|^2 s + v. N is the floor of the data and G the response of the model's linear part to
a force at the motor. The power s of an unmodelled force and the power v of an unmodelled motion, both white, are estimated for each model.
Where both are small this is output error in units of the noise; where v is large it is plain output error, and where s is large it is
inverse dynamics (Ljung, System Identification, 2nd ed., sec. 3.2 and 10.1). The terms are Whittle's (1953): ln S + P / S for each line of
each window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects._contract import arguments
from xy_sysid.greybox.floor import Bands, Floor
from xy_sysid.samples.block import FloatArray

ROUNDS = 100  # of the multiplicative updates, at most
SETTLED = 1e-4  # relative change of both powers that ends them


@dataclass(frozen=True)
class Objective:
    """Scores errors by band. floor: (bands,) N, m^2/s^2; lines: (bands,) that count: those of the excited bands."""

    floor: FloatArray
    lines: FloatArray

    @staticmethod
    def of(floor: Floor) -> Objective:
        """Of the floor of some data; where no band is excited all count."""
        used = floor.excited if bool(np.any(floor.excited)) else np.ones_like(floor.excited)
        return Objective(np.maximum(floor.power, 1e-300), floor.lines * used)

    @cached_property
    def count(self) -> float:
        """Lines that count."""
        return float(np.sum(self.lines))

    def unmodelled(self, power: FloatArray, response: FloatArray) -> tuple[float, float]:
        """(s, v): powers of the unmodelled force, V^2, and motion, m^2/s^2, that make an error of this power (bands,) likeliest.

        response: (bands,) |G|^2
        """
        if not np.all(np.isfinite(power[self.lines > 0.0])):
            return 0.0, 0.0
        force, motion = likeliest(self.floor, power, response, self.lines)
        return float(force), float(motion)

    def spectrum(self, power: FloatArray, response: FloatArray) -> FloatArray:
        """(bands,) S, m^2/s^2, with the likeliest unmodelled force and motion."""
        force, motion = self.unmodelled(power, response)
        return np.asarray(self.floor + force * response + motion)

    def each(self, powers: FloatArray, spectrum: FloatArray) -> FloatArray:
        """(windows,) nats of each half overlapping window's power (windows, bands), above an error that is the floor alone."""
        with np.errstate(over="ignore", invalid="ignore"):  # of a model that runs away
            found = 0.5 * (np.log(spectrum / self.floor) + powers / spectrum - 1.0) @ self.lines
        return np.where(np.isfinite(found), found, np.inf)

    def score(self, power: FloatArray, spectrum: FloatArray) -> float:
        """The same of a mean power (bands,), nats a line."""
        return float(self.each(power[None, :], spectrum)[0]) / max(0.5 * self.count, 1.0)

    def of_power(self, power: FloatArray, response: FloatArray) -> float:
        """Score of an error's power (bands,), nats a line, with the unmodelled force and motion that suit it."""
        return self.score(power, self.spectrum(power, response))

    def forced(self, spectrum: FloatArray) -> float:
        """Lines of a window in which what is unmodelled stands out of the floor: those that tell how large it is."""
        return float(self.lines @ (1.0 - self.floor / spectrum) ** 2)


@njit(cache=True)
def likeliest(floor: FloatArray, power: FloatArray, response: FloatArray, lines: FloatArray) -> tuple[float, float]:
    """(s, v) as of ``Objective.unmodelled``, by multiplicative updates of the Itakura-Saito divergence (Fevotte, Bertin & Durrieu 2009, sec. 2.3)."""
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


def responder(layout: Bands, model: AxisModel) -> Callable[[FloatArray], FloatArray]:
    """A function from a row of the model's parameters (see ``axis.simulator``) to (bands,) |G|^2, (m/s/V)^2: its response to a force."""
    turn = np.exp(-2j * np.pi * layout.frequency / layout.sampling_rate)
    omega2 = (2.0 * np.pi * layout.frequency) ** 2
    as_judged = layout.amplitude**2
    sections = []
    at = 3
    for name, values in model.effects:
        effect = model.library[name]
        if effect.category == "motion":
            sections.append((effect, at))
        at += len(values)

    def respond(row: FloatArray) -> FloatArray:
        gain, pole = float(row[0]), float(row[2])
        power = as_judged * (gain * pole) ** 2 / (omega2 + pole**2)
        for effect, place in sections:
            own = dict(zip(effect.names, row[place : place + len(effect.names)].tolist(), strict=True))
            section = effect.functions["section"]
            words = {**own, "fs": layout.sampling_rate}
            b0, b1, b2, a1, a2 = section(**{word: words[word] for word in arguments(section)})
            power = power * np.abs((b0 + (b1 + b2 * turn) * turn) / (1.0 + (a1 + a2 * turn) * turn)) ** 2
        return np.asarray(np.bincount(layout.band, power, layout.count) / layout.lines)

    return respond
