"""Is one set of effects better than another on held-out data, by how much, and by more than chance?"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import CHANCE, LARGEST, OVERLAP
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Gain:
    """Gain of one fit over another.

    each: (windows,) nats of each held-out window, which half overlap; recording: (windows,) index of the recording of each
    """

    each: FloatArray
    recording: NDArray[np.int64]

    @property
    def nats(self) -> float:
        """On all windows."""
        return float(np.sum(self.each))

    @property
    def probability(self) -> float:
        """Probability that it is better, 0..1, by Student's t over the windows, of the roots of their gains.

        A gain grows with the square of the motion by an effect. Where an effect acts more in one window than in others, as a spring does far out,
        the gains differ so much that a test of their mean would take them for chance. The recordings are strata of a sample: each has its own mean,
        and 0 if it has only one window (Cochran, Sampling Techniques, 1977, ch. 5).
        """
        if not math.isfinite(self.nats):
            return float(self.nats > 0.0)
        root = np.sign(self.each) * np.sqrt(np.abs(self.each))
        parts = [root[self.recording == k] for k in np.unique(self.recording)]
        variance = OVERLAP * sum(part.size * (float(np.var(part, ddof=1)) if part.size > 1 else float(part[0] ** 2)) for part in parts)
        if variance == 0.0:
            return 0.5 if self.nats == 0.0 else float(self.nats > 0.0)
        return float(scipy.stats.t.cdf(float(np.sum(root)) / math.sqrt(variance), max(root.size / OVERLAP - len(parts), 1.0)))

    @property
    def is_sure(self) -> bool:
        """More than chance."""
        return self.probability > CHANCE

    def priced(self, nats: float) -> Gain:
        """With this many nats more, for parameters, spread over the windows."""
        return replace(self, each=self.each + nats / self.each.size)


def gain(one: GreyboxFit, other: GreyboxFit, recording: NDArray[np.int64] | None = None) -> Gain:
    """Gain of one fit over another of the same data, paired over windows; recording: (windows,) the recording of each, by default one."""
    if np.all(np.isfinite(one.scores)) and np.all(np.isfinite(other.scores)):
        each = other.scores - one.scores
    else:
        each = np.full(one.scores.size, math.inf if np.all(np.isfinite(one.scores)) else -math.inf)
    return Gain(each, np.zeros(each.size, dtype=np.int64) if recording is None else recording)


def size(one: GreyboxFit, before: GreyboxFit) -> float:
    """Power that a fit explains of the error of an earlier one, divided by the power that remains: of the unmodelled force or the error, the larger.

    The power of the force is an average over frequencies; a load or a slow wave acts at few of them, and may still be most of the error.
    """
    force = force_explained(one, before)
    error = math.log(max(before.held_out_error, 1e-300) / max(one.held_out_error, 1e-300))
    return max(force, math.expm1(min(2.0 * error, LARGEST))) if force > 0.0 else force


def force_explained(one: GreyboxFit, before: GreyboxFit) -> float:
    """The same for the unmodelled force alone: n nats over l lines in which it exceeds the floor are a factor exp(2 n / l) of its power."""
    nats = float(np.mean(before.scores) - np.mean(one.scores))
    return math.expm1(min(max(2.0 * nats / max(before.forced, 1.0), -LARGEST), LARGEST))
