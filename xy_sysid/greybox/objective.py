"""One score of a model on data: the likelihood of its error, caused by the encoder's noise and by a force that the model does not have.

The spectrum of the error in velocity is S(f) = N(f) + |G(f)|^2 s. N is the floor of the data, G the response of the model's linear part to a
force at the motor, and s the power of the unmodelled force, estimated for each model. Where s is small this is output error; where s is large
it is inverse dynamics (Ljung, System Identification, 2nd ed., sec. 3.2 and 10.1). The terms are Whittle's (1953): ln S + P / S for each line of each window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects._contract import arguments
from xy_sysid.greybox.floor import Bands, Floor
from xy_sysid.samples.block import FloatArray

LEVELS = np.concatenate(([0.0], np.geomspace(1e-9, 10.0, 81)))  # of the unmodelled force's power, over the largest that any band asks for
REFINED = 4  # Newton steps from the best of these


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

    def force_power(self, power: FloatArray, response: FloatArray) -> float:
        """s, V^2: the power of the unmodelled force that makes an error of this power (bands,) likeliest; response: (bands,) |G|^2."""
        used = (self.lines > 0.0) & (response > 0.0)
        if not np.any(used) or not np.all(np.isfinite(power[used])):
            return 0.0
        n, p, g, lines = self.floor[used], power[used], response[used], self.lines[used]
        largest = float(np.max((p - n) / g))
        if not largest > 0.0:
            return 0.0
        levels = LEVELS * largest
        s = n[None, :] + np.outer(levels, g)
        place = int(np.argmin((np.log(s) + p / s) @ lines))
        if place == 0:
            return 0.0
        low, high = np.log(levels[max(place - 1, 1)]), np.log(levels[min(place + 1, levels.size - 1)])
        x = np.log(levels[place])
        for _ in range(REFINED):  # Fisher scoring on the logarithm
            part = np.exp(x) * g
            spectrum = n + part
            slope = float(lines @ (part / spectrum * (1.0 - p / spectrum)))
            bend = float(lines @ (part / spectrum) ** 2)
            x = float(np.clip(x - slope / max(bend, 1e-300), low, high))
        return float(np.exp(x))

    def spectrum(self, power: FloatArray, response: FloatArray) -> FloatArray:
        """(bands,) S, m^2/s^2, with the likeliest unmodelled force."""
        return np.asarray(self.floor + self.force_power(power, response) * response)

    def each(self, powers: FloatArray, spectrum: FloatArray) -> FloatArray:
        """(windows,) nats of each half overlapping window's power (windows, bands), above an error that is the floor alone."""
        with np.errstate(over="ignore", invalid="ignore"):  # of a model that runs away
            found = 0.5 * (np.log(spectrum / self.floor) + powers / spectrum - 1.0) @ self.lines
        return np.where(np.isfinite(found), found, np.inf)

    def score(self, power: FloatArray, spectrum: FloatArray) -> float:
        """The same of a mean power (bands,), nats a line."""
        return float(self.each(power[None, :], spectrum)[0]) / max(0.5 * self.count, 1.0)

    def of_power(self, power: FloatArray, response: FloatArray) -> float:
        """Score of an error's power (bands,), nats a line, with the unmodelled force that suits it."""
        return self.score(power, self.spectrum(power, response))

    def forced(self, spectrum: FloatArray) -> float:
        """Lines of a window in which the unmodelled force stands out of the floor: those that tell how large it is."""
        return float(self.lines @ (1.0 - self.floor / spectrum) ** 2)


def responder(layout: Bands, model: AxisModel) -> Callable[[FloatArray], FloatArray]:
    """A function from a row of the model's parameters (see ``axis.simulator``) to (bands,) |G|^2, (m/s/V)^2: the power of its response to a force."""
    turn = np.exp(-2j * np.pi * layout.frequency / layout.sampling_rate)
    omega2 = (2.0 * np.pi * layout.frequency) ** 2
    sections = []
    at = 3
    for name, values in model.effects:
        effect = model.library[name]
        if effect.category == "motion":
            sections.append((effect, at))
        at += len(values)

    def respond(row: FloatArray) -> FloatArray:
        gain, pole = float(row[0]), float(row[2])
        power = (gain * pole) ** 2 / (omega2 + pole**2)
        for effect, place in sections:
            own = dict(zip(effect.names, row[place : place + len(effect.names)].tolist(), strict=True))
            section = effect.functions["section"]
            words = {**own, "fs": layout.sampling_rate}
            b0, b1, b2, a1, a2 = section(**{word: words[word] for word in arguments(section)})
            power = power * np.abs((b0 + (b1 + b2 * turn) * turn) / (1.0 + (a1 + a2 * turn) * turn)) ** 2
        return np.asarray(np.bincount(layout.band, power, layout.count) / layout.lines)

    return respond
