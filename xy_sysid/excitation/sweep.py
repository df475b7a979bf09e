"""Swept sine that repeats without a jump: the frequency rises linearly from low to high, and returns smoothly.

The return takes the last twentieth of the period along a raised cosine, so that phase and frequency are continuous;
high is lowered by less than two lines so that a period holds whole cycles.

Source: linear chirp; the return is this project's choice, because a sweep up and down leaves holes in the line spectrum.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation.contract import Periodic, below_nyquist, samples
from xy_sysid.settings import AxisExcitation

RETURN = 0.05  # part of the period in which the frequency returns to low


def sweep(settings: AxisExcitation, rate: float) -> Periodic:
    """Sine of the set rms swept from low to high once a period; raises BadInput if the period is shorter than a cycle."""
    below_nyquist(settings, rate)
    period = samples(settings.period, rate, 4, "period")
    cycles = np.floor((settings.low + settings.high) / 2 * period / rate + 1e-9)
    low, high = settings.low * period / rate, 2 * cycles - settings.low * period / rate
    if cycles < 1 or high < low:
        raise BadInput("period of the sweep", f"{settings.period:g} s", "at least one cycle at the mean frequency", "Lengthen period or raise high.")
    s = np.arange(period) / period
    up = 1 - RETURN
    rise = low * s + (high - low) * s**2 / (2 * up)
    back = s - up
    fall = (low + high) / 2 * (back + up) + (high - low) / 2 * RETURN / np.pi * np.sin(np.pi * back / RETURN)
    return Periodic(np.sqrt(2) * settings.rms * np.sin(2 * np.pi * np.where(s < up, rise, fall)))
