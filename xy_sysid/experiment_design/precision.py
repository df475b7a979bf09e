"""The experiment for precise parameters: one of them to a given interval (c-optimality), or all of them (D-optimality).

The covariance of the later fit is predicted from the sensitivities of the simulated motion: the inverse of the information of the present
data and the experiment, plus a contribution of inexact laws, which does not fall with time (Fedorov, Theory of optimal experiments, 1972).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.forward import move
from xy_sysid.axis.model import AxisModel
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.beliefs import Belief, Evidence, believed
from xy_sysid.experiment_design.criteria import COARSE, DRAWN, FINAL, FITTED, LONGER, SHORTEST
from xy_sysid.experiment_design.design import broken_in_time
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.prediction import Recorded, Setting, expected_error, predicted, recorded, slopes
from xy_sysid.experiment_design.proposals import neighbours, proposals
from xy_sysid.greybox.axis_data import AxisData, prepare_all
from xy_sysid.greybox.free_run import GreyboxFit, finish
from xy_sysid.greybox.least_squares import model_error_covariance
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True)
class Information:
    """Information of an experiment on a belief's parameters. each_second: (k, k); law: (k, k) covariance that does not fall with time."""

    each_second: FloatArray
    law: FloatArray

    def covariance(self, before: FloatArray, seconds: float) -> FloatArray:
        """(k, k) covariance of the coordinates after some seconds; before: (k, k) information of the present data."""
        return _inverse(before + FITTED * seconds * self.each_second) + self.law


def information(belief: Belief, model: AxisModel, item: Recorded) -> Information:
    """The information of a simulated recording of a model."""
    least = expected_error(item, belief)
    layout = item.windows.layout
    weight = ((item.objective.lines > 0.0) / np.sqrt(least))[layout.band]
    change = slopes(item, belief, model, predicted(item, model)) * weight
    columns = change.reshape(change.shape[0], -1).view(np.float64)
    normal = columns @ columns.T
    law = model_error_covariance(change, item.trusted * item.velocity * weight, layout, _inverse(normal + belief.precision))
    return Information(normal / item.seconds, law)


@dataclass(frozen=True)
class Sharpest:
    """experiment: the best; None if none is needed or none is within the limits; width: expected half width of the 95 % interval (``Precision``)
    possible: True if that reaches the wanted width; before: half width from the present data
    """

    experiment: Experiment | None
    width: float
    possible: bool
    before: float


@dataclass(frozen=True)
class Precision:
    """parameter: as ``gain`` or ``effect.parameter``; width: half width of the 95 % interval, fraction of the value."""

    parameter: str
    width: float

    def place(self, belief: Belief) -> int:
        """Index of the parameter among the coordinates."""
        names = list(belief.model.values())
        if self.parameter not in names:
            raise BadInput("parameter", repr(self.parameter), ", ".join(names), "Choose one of these.")
        return names.index(self.parameter)

    def of_interval(self, found: Estimate) -> float:
        """The relative half width of an estimate of a fit."""
        half = 0.5 * (found.high - found.low)
        return half / abs(found.value) if found.value else math.inf

    def half_width(self, belief: Belief, covariance: FloatArray) -> float:
        """The relative half width for a covariance of the coordinates."""
        place = self.place(belief)
        spread = Z95 * math.sqrt(max(float(covariance[place, place]), 0.0))
        if belief.scale.positive[place]:
            return math.expm1(min(spread, 50.0))
        value = abs(float(belief.model.row[place]))
        return spread * float(belief.scale.unit[place]) / value if value else math.inf


def sharpest(data: AxisData, found: GreyboxFit, limits: MachineLimits, target: Precision) -> Sharpest:
    """The experiment that determines a parameter of a fit to the wanted width in the shortest time, or as well as possible.

    The experiment is chosen by its information. Its duration is found by a rehearsal: the fit of a simulated recording with noise.
    """
    before = target.of_interval(found.parameter(target.parameter))
    if before <= target.width:
        return Sharpest(None, before, True, before)
    setting, belief = Setting.of(data, limits.ramp), believed(Evidence(data, limits.travel), found, DRAWN)
    rate, most = setting.layout.sampling_rate, limits.seconds - limits.ramp
    near = [item for _, item in _best_first(setting, belief, limits, target, proposals(limits, rate), draws=1)[:FINAL]]
    near += neighbours(near[0], limits, rate) if near else ()

    def stays(experiment: Experiment) -> bool:
        return not broken_in_time(belief.draws, data.sampling_rate, limits, experiment)

    for seconds, best in _best_first(setting, belief, limits, target, near):
        lasts = min(max(math.ceil((seconds if math.isfinite(seconds) else most) + limits.ramp), SHORTEST), limits.seconds)
        if not stays(best.lasting(float(lasts))):
            continue
        while True:
            width = rehearsed(data, belief, best.lasting(float(lasts)), limits, target)
            longer = min(math.ceil(LONGER * lasts), limits.seconds)
            if width <= target.width or lasts >= limits.seconds or not stays(best.lasting(float(longer))):
                return Sharpest(best.lasting(float(lasts)), width, width <= target.width, before)
            lasts = longer
    return Sharpest(None, before, False, before)


def rehearsed(data: AxisData, belief: Belief, experiment: Experiment, limits: MachineLimits, target: Precision) -> float:
    """Half width from a fit of the present data and a simulated recording of the experiment, with the encoder's noise."""
    rate = data.sampling_rate
    motion = move(belief.model, rate, experiment.drive(rate, experiment.seconds, limits.start), COARSE)
    noise = data.floor.encoder * np.random.default_rng(0).standard_normal(motion.position.size)
    recordings = [(data.voltage[run], data.position[run]) for run in data.runs]
    both = prepare_all(rate, [*recordings, (motion.voltage, motion.position + noise)], data.floor.epsilon, data.units)
    return target.of_interval(finish(both, belief.model).parameter(target.parameter))


def _best_first(
    setting: Setting, belief: Belief, limits: MachineLimits, target: Precision, experiments: Sequence[Experiment], draws: int = DRAWN
) -> list[tuple[float, Experiment]]:
    """(s until the wanted width is reached, experiment) of the experiments within the limits, the best first; infinite s if it is not reached."""
    judged: list[tuple[float, float, int, Experiment]] = []
    for experiment in experiments:
        found = informations(setting, belief, limits, experiment, draws)
        if found:
            judged.append((*_needed(belief, found, target, limits.seconds - limits.ramp), len(judged), experiment))
    return [(seconds, experiment) for seconds, _, _, experiment in sorted(judged, key=lambda item: item[:3])]


def informations(setting: Setting, belief: Belief, limits: MachineLimits, experiment: Experiment, draws: int = DRAWN) -> list[Information]:
    """Information of one experiment, for some draws; empty if a draw would exceed a limit or would not move."""
    found = []
    for model in belief.draws[:draws]:
        item = recorded(setting, experiment, model, limits.start)
        if not item.moves or limits.broken(item.motion):
            return []
        found.append(information(belief, model, item))
    return found


def _needed(belief: Belief, found: Sequence[Information], target: Precision, most: float) -> tuple[float, float]:
    """s until the mean interval over draws reaches the wanted width, infinite if ``most`` do not suffice; and the half width then."""
    if _width(belief, found, target, most) > target.width:
        return math.inf, _width(belief, found, target, most)
    low, high = 0.0, most
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _width(belief, found, target, middle) <= target.width else (middle, high)
    return high, _width(belief, found, target, high)


def _width(belief: Belief, found: Sequence[Information], target: Precision, seconds: float) -> float:
    """Half width of the 95 % interval after some seconds, mean over draws."""
    return float(np.mean([target.half_width(belief, item.covariance(belief.precision, seconds)) for item in found]))


def _inverse(matrix: FloatArray) -> FloatArray:
    unit = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray(np.linalg.pinv(matrix / np.outer(unit, unit), rcond=1e-13, hermitian=True) / np.outer(unit, unit))
