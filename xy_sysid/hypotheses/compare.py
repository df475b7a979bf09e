"""Is one set of effects better than another on held-out data, by how much, and by more than chance?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import CHANCE, OVERLAP


@dataclass(frozen=True, slots=True)
class Gain:
    """nats: gain of one fit over another on all held-out windows; error: its standard error; windows: number of independent windows."""

    nats: float
    error: float
    windows: float

    @property
    def probability(self) -> float:
        """Probability that it is better, 0..1, by Student's t over the windows."""
        if not math.isfinite(self.nats):
            return float(self.nats > 0.0)
        if self.error == 0.0:
            return 0.5 if self.nats == 0.0 else float(self.nats > 0.0)
        return float(scipy.stats.t.cdf(self.nats / self.error, max(self.windows - 1.0, 1.0)))

    @property
    def is_sure(self) -> bool:
        """More than chance."""
        return self.probability > CHANCE


def gain(one: GreyboxFit, other: GreyboxFit) -> Gain:
    """Gain of one fit over another of the same data, paired over windows."""
    if not np.all(np.isfinite(one.scores)):
        return Gain(-math.inf, 0.0, 1.0)
    if not np.all(np.isfinite(other.scores)):
        return Gain(math.inf, 0.0, 1.0)
    each = other.scores - one.scores
    spread = float(np.std(each, ddof=1)) * math.sqrt(OVERLAP * each.size) if each.size > 1 else math.inf
    return Gain(float(np.sum(each)), spread, each.size / OVERLAP)


def size(one: GreyboxFit, before: GreyboxFit) -> float:
    """Power that a fit explains of the error of an earlier one, divided by the power that remains: of the unmodelled force or the error, the larger.

    The power of the force is an average over frequencies; a load or a slow wave acts at few of them, and may still be most of the error.
    """
    force = force_explained(one, before)
    error = math.log(max(before.held_out_error, 1e-300) / max(one.held_out_error, 1e-300))
    return max(force, math.expm1(min(2.0 * error, 50.0))) if force > 0.0 else force


def force_explained(one: GreyboxFit, before: GreyboxFit) -> float:
    """The same for the unmodelled force alone: n nats over l lines in which it exceeds the floor are a factor exp(2 n / l) of its power."""
    nats = float(np.mean(before.scores) - np.mean(one.scores))
    return math.expm1(min(max(2.0 * nats / max(before.forced, 1.0), -50.0), 50.0))
