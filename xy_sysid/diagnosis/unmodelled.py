"""The force that nobody modelled: what a fit leaves beyond the encoder's noise, as a force at the motor in the unit of the input."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.objective import Objective
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class UnmodelledForce:
    """bands: (from, to, rms) of each excited band, Hz and the unit of the input; input: standard deviation of the whole input, in its unit."""

    bands: tuple[tuple[float, float, float], ...]
    input: float

    @property
    def rms(self) -> float:
        """Over all of its bands."""
        return math.sqrt(sum(rms**2 for _, _, rms in self.bands))

    @property
    def mostly(self) -> tuple[float, float]:
        """(from, to) Hz: without the lowest tenth of its power and the highest fifth."""
        low, high, rms = np.array(self.bands).T
        return main_range(low, high, rms**2)


def main_range(low: FloatArray, high: FloatArray, power: FloatArray) -> tuple[float, float]:
    """(from, to) Hz of bands from low to high without the lowest tenth of their power and the highest fifth; the power is above 0."""
    share = np.cumsum(power) / np.sum(power)
    first, last = (min(int(np.searchsorted(share, at)), share.size - 1) for at in (0.1, 0.8))
    return float(low[first]), float(high[last])


def unmodelled_force(data: AxisData, fit: GreyboxFit) -> UnmodelledForce | None:
    """Of the held-out error of a fit, by the machine's response to a force at the motor (``Floor.response``), which acts as its input does.

    What the objective takes for noise or for an unmodelled motion is no force: where the machine hardly answers, that would be huge.
    None of a fit that is judged one sample ahead, of one that runs away, and where nothing is excited or stands out of the noise.
    """
    layout, response = data.layout, data.floor.response
    seen = data.floor.excited & (response > 0.0)
    beyond = np.maximum(fit.power - data.floor.noise, 0.0)
    if fit.one_step or not np.all(np.isfinite(fit.power)) or not np.any(beyond[seen] > 0.0):
        return None
    edges, each = layout.edges(), 2.0 * layout.lines / layout.length
    force, motion = Objective.of(data.floor).unmodelled(fit.power)
    share = force / (force * response + motion + data.floor.power)  # of each band's power that is a force's, over |G|^2
    bands = tuple((float(edges[k]), float(edges[k + 1]), math.sqrt(float(each[k] * beyond[k] * share[k]))) for k in np.flatnonzero(seen).tolist())
    return UnmodelledForce(bands, float(np.std(data.voltage)))
