"""Is the error of a fit noise on its input? A measured current or voltage contains noise that does not act on the machine, but looks like a force."""

from __future__ import annotations

import math

import numpy as np
import scipy

from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.objective import Objective
from xy_sysid.hypotheses.criteria import FEWEST, OVERLAP, WHITE
from xy_sysid.samples.block import FloatArray


def input_noise(data: AxisData, fit: GreyboxFit) -> float | None:
    """rms of white noise on the input, V, that alone explains the spectrum of the held-out error of a rigid model above the floor, or None.

    The spectrum is N + |G|^2 s with the model's own response G, through which the noise goes; s is the likeliest one.
    The power of each band over it is a mean of chi-squares, so that twice the
    logarithm of the likelihood ratio to a spectrum that fits every band is a chi-square, too (Wilks 1938). Friction, cables and
    resonances leave a force that is not white.
    """
    lines = Objective.of(data.floor).lines
    used = lines > 0.0
    power, floor = fit.power[used], data.floor.power[used]
    response, shape = _response(data, fit)[used], lines[used] * data.held_out.begins.size / OVERLAP
    if fit.one_step or int(used.sum()) < FEWEST or not np.all(np.isfinite(power)) or not np.all(response > 0.0):
        return None

    def deviance(logarithm: float) -> float:
        ratio = power / (floor + math.exp(logarithm) * response)
        return float(2.0 * shape @ (ratio - 1.0 - np.log(np.maximum(ratio, 1e-300))))

    least, most = (math.log(float(limit(power / response))) for limit in (np.min, np.max))
    found = scipy.optimize.minimize_scalar(deviance, bounds=(least - 20.0, most), method="bounded")
    is_white = scipy.stats.chi2.sf(found.fun, int(used.sum()) - 1) > WHITE
    return math.exp(0.5 * float(found.x)) if is_white else None


def _response(data: AxisData, fit: GreyboxFit) -> FloatArray:
    """(bands,) |G|^2 of the rigid model, (m/s/V)^2."""
    layout, gain, pole = data.layout, fit.model.gain, fit.model.pole
    power = (layout.amplitude * gain * pole) ** 2 / ((2.0 * np.pi * layout.frequency) ** 2 + pole**2)
    return np.asarray(np.bincount(layout.band, power, layout.count) / layout.lines)
