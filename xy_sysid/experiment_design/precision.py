"""The experiment that makes parameters known best: one of them to an interval that is asked for (c-optimality), or all of them (D-optimality).

The covariance that a fit will report is predicted from the sensitivities of the simulated motion: the inverse of the information of the data at
hand and of the experiment, and what laws that are not exact add however long it lasts (Fedorov, Theory of optimal experiments, 1972).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.design import FINAL, SHORTEST
from xy_sysid.experiment_design.experiment import RAMP, Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.prediction import Recorded, Setting, expected_error, predicted, recorded, slopes
from xy_sysid.experiment_design.proposals import neighbours, proposals
from xy_sysid.greybox.axis_data import HELD, SEEN
from xy_sysid.greybox.least_squares import of_the_law
from xy_sysid.greybox.parameters import Z95
from xy_sysid.samples.block import FloatArray

FITTED = SEEN / (SEEN + HELD)  # part of a record that a fit sees
DRAWS = 2  # of the parameters that are looked at


@dataclass(frozen=True)
class Information:
    """What an experiment tells of the parameters of a belief. each_second: (k, k); law: (k, k) covariance that does not fall with time."""

    each_second: FloatArray
    law: FloatArray

    def covariance(self, before: FloatArray, seconds: float) -> FloatArray:
        """(k, k) of the coordinates after some seconds; before: (k, k) information of the data at hand."""
        return _inverse(before + FITTED * seconds * self.each_second) + self.law


def information(belief: Belief, model: AxisModel, item: Recorded) -> Information:
    """Of a recording that a model would make."""
    least, _ = expected_error(item, belief, model)
    layout = item.windows.layout
    weight = ((item.objective.lines > 0.0) / np.sqrt(least))[layout.band]
    change = slopes(item, belief, model, predicted(item, model)) * weight
    columns = change.reshape(change.shape[0], -1).view(np.float64)
    normal = columns @ columns.T
    law = of_the_law(change, item.trusted * item.velocity * weight, layout, _inverse(normal))
    return Information(normal / item.seconds, law)


@dataclass(frozen=True)
class Sharpest:
    """experiment: the best, or None where none is within the limits; width: half of the 95 % interval that is expected, as ``Wanted`` says
    possible: whether that is as narrow as asked for; before: half of the interval by the data at hand
    """

    experiment: Experiment | None
    width: float
    possible: bool
    before: float


@dataclass(frozen=True)
class Wanted:
    """parameter: as ``gain`` or ``effect.parameter``; width: half of the 95 % interval, as a part of a positive value, else in its unit."""

    parameter: str
    width: float

    def place(self, belief: Belief) -> int:
        """Of the parameter among the coordinates."""
        names = list(belief.model.values())
        if self.parameter not in names:
            raise BadInput("parameter", repr(self.parameter), ", ".join(names), "Choose one of these.")
        return names.index(self.parameter)

    def half_width(self, belief: Belief, covariance: FloatArray) -> float:
        """Of the interval that a covariance of the coordinates means."""
        place = self.place(belief)
        spread = Z95 * math.sqrt(max(float(covariance[place, place]), 0.0))
        if belief.scale.positive[place]:
            return math.expm1(min(spread, 50.0))
        value = abs(float(belief.model.row[place]))
        spread *= float(belief.scale.unit[place])
        return spread / value if place < 1 else spread


def sharpest(setting: Setting, belief: Belief, limits: MachineLimits, target: Wanted, seed: int = 1) -> Sharpest:
    """The experiment after which a parameter is known as well as asked for in the least time, or best where none gets there."""
    before = target.half_width(belief, _inverse(belief.precision))
    most = limits.seconds - RAMP
    judged = []
    for experiment in _rounds(setting, belief, limits, target, seed):
        found = informations(setting, belief, limits, experiment)
        if found:
            judged.append((*_needed(belief, found, target, most), experiment))
    if not judged:
        return Sharpest(None, before, before <= target.width, before)
    seconds, width, best = min(judged, key=lambda item: item[:2])
    lasts = min(max(math.ceil((seconds if math.isfinite(seconds) else most) + RAMP), SHORTEST), limits.seconds)
    return Sharpest(best.lasting(float(lasts)), width, math.isfinite(seconds), before)


def _rounds(setting: Setting, belief: Belief, limits: MachineLimits, target: Wanted, seed: int) -> Sequence[Experiment]:
    """Proposals, and neighbours of the best of them."""
    rate, most = setting.layout.sampling_rate, limits.seconds - RAMP
    first = proposals(limits, rate, seed)
    judged: list[tuple[float, float, int, Experiment]] = []
    for experiment in first:
        found = informations(setting, belief, limits, experiment, draws=1)
        if found:
            judged.append((*_needed(belief, found, target, most), len(judged), experiment))
    best = [item[-1] for item in sorted(judged, key=lambda item: item[:3])[:FINAL]]
    return [*best, *(neighbours(best[0], limits, rate) if best else ())]


def informations(setting: Setting, belief: Belief, limits: MachineLimits, experiment: Experiment, draws: int = DRAWS) -> list[Information]:
    """Of one experiment, for some draws; none where a draw would break a limit."""
    found = []
    for model in belief.draws[:draws]:
        item = recorded(setting, experiment, model, limits.start)
        if limits.broken(item.motion):
            return []
        found.append(information(belief, model, item))
    return found


def _needed(belief: Belief, found: Sequence[Information], target: Wanted, most: float) -> tuple[float, float]:
    """s until the mean interval over draws is as narrow as asked for, infinite if ``most`` do not suffice; and half its width there."""

    def width(seconds: float) -> float:
        return float(np.mean([target.half_width(belief, item.covariance(belief.precision, seconds)) for item in found]))

    if width(most) > target.width:
        return math.inf, width(most)
    low, high = 0.0, most
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if width(middle) <= target.width else (middle, high)
    return high, width(high)


def volume(belief: Belief, found: Sequence[Information], seconds: float) -> float:
    """Logarithm of the volume of the region in which the parameters lie after an experiment (D-optimality), in the mean over draws."""
    return float(np.mean([-0.5 * np.linalg.slogdet(belief.precision + FITTED * seconds * item.each_second)[1] for item in found]))


def _inverse(matrix: FloatArray) -> FloatArray:
    unit = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(np.linalg.pinv(matrix / np.outer(unit, unit), rcond=1e-13, hermitian=True) / np.outer(unit, unit))
