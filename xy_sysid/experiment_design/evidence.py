"""How well a rival would explain a recording if a set of effects were true, and the probability of a decision after a given time.

T-optimality (Atkinson & Fedorov, The design of experiments for discriminating between two rival models, Biometrika 62, 1975): the error of
the rival with the parameters that fit the experiment best. These may differ as far as the present data allow. The error is scored by the
objective of every fit here (``greybox.objective``), so errors explained by noise, an unmodelled force or an unmodelled motion do not count.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from xy_sysid.axis.model import AxisModel
from xy_sysid.diagnosis.sets import contains
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.criteria import CONVERGED, DAMPED, JUDGED, ODDS, ROUNDS, SURE, TRIALS, UNLIKE
from xy_sysid.experiment_design.prediction import Recorded, expected_error, predicted, slopes
from xy_sysid.hypotheses.criteria import PRICE
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Power:
    """Evidence for one draw of one set against one rival. price: nats for its additional parameters

    nats: of the ``seen`` seconds that were simulated, with what the rival loses on the present data; rate: nats per second after them. The
    present data count once: over a longer experiment, the rival gives them up.
    """

    truth: int
    rate: float
    price: float
    nats: float = 0.0
    seen: float = 0.0

    def after(self, seconds: float) -> float:
        """Expected nats after some seconds, an upper bound beyond those that were simulated."""
        if seconds < self.seen:
            return self.nats * max(seconds, 0.0) / self.seen
        return self.nats + self.rate * (seconds - self.seen)

    def probability(self, seconds: float) -> float:
        """Probability that the rival is refuted after some seconds: the log likelihood ratio is normal, and its variance is twice its mean."""
        mean = JUDGED * self.after(seconds)
        if mean <= 0.0:
            return 0.0
        return float(ndtr((mean - ODDS - self.price) / math.sqrt(2.0 * mean)))


def powers(beliefs: Sequence[Belief], truth: int, model: AxisModel, item: Recorded, rounds: int = ROUNDS) -> list[Power]:
    """Powers for one draw of a set: for the first set against every other one, for another set against the first.

    A rival that contains the set as a special case is left out, because it explains everything that the set explains.
    """
    own, library = beliefs[truth], model.library
    found = []
    for number, rival in enumerate(beliefs):
        if number == truth or 0 not in (number, truth) or contains(library, frozenset(rival.effects), frozenset(own.effects)):
            continue
        whole, lost = nats((own, rival), model, item, rounds)
        rate = max(whole - lost, 0.0) / item.seconds
        price = PRICE * max(own.free - rival.free, 0)
        found.append(Power(truth=truth, rate=rate, price=price, nats=whole, seen=item.seconds))
    return found


def nats(sets: tuple[Belief, Belief], model: AxisModel, item: Recorded, rounds: int = ROUNDS) -> tuple[float, float]:
    """Expected log likelihood ratio over a recording's windows: a model of the first set against the second set, refitted to that recording.

    Returns the ratio, and the part of it that the second set loses on the present data. The refit (Levenberg-Marquardt) ends when it converges; fewer
    rounds give an upper bound.
    """
    own, rival = sets
    least, count = expected_error(item, own), item.windows.begins.size
    excited, layout = item.objective.lines > 0.0, item.windows.layout
    centre = rival.inner(rival.model)

    def scored(inner: FloatArray) -> tuple[float, NDArray[np.complex128], FloatArray]:
        """Nats of the rival with these coordinates, its prediction, and the power of its error with what explains the truth's, (bands,)."""
        now = predicted(item, rival.moved(inner))
        power = least + layout.power(item.velocity - now)
        off = inner - centre
        score = item.objective.nats(item.objective.of_power(power), count) if np.all(np.isfinite(power)) else math.inf
        return score + 0.5 * float(off @ rival.precision @ off), now, power

    inner, damping = centre.copy(), 0.0
    best, now, power = scored(inner)
    for _ in range(rounds if math.isfinite(best) else 0):
        weight = (excited / np.sqrt(item.objective.spectrum(power)))[layout.band]
        columns = (slopes(item, rival, rival.moved(inner), now) * weight).reshape(inner.size, -1).view(np.float64)
        left = ((item.velocity - now) * weight).ravel().view(np.float64)
        if not np.all(np.isfinite(columns)):
            break
        normal = columns @ columns.T + rival.precision
        right = columns @ left - rival.precision @ (inner - centre)
        gained = 0.0
        for _ in range(TRIALS):
            step = np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), right)[0]
            moved = rival.scale.inner(rival.scale.outer(inner + step))
            found = scored(moved)
            if found[0] < best:
                gained, inner, damping, (best, now, power) = best - found[0], moved, 0.1 * damping, found
                break
            damping = max(10.0 * damping, DAMPED)
        if gained < CONVERGED:
            break
    drawn = own.inner(model) - own.inner(own.model)
    truth = item.objective.nats(item.objective.of_power(least), count) + 0.5 * float(drawn @ own.precision @ drawn)
    off = inner - centre
    return (max(best - truth, 0.0), 0.5 * float(off @ rival.precision @ off)) if math.isfinite(best) else (UNLIKE, 0.0)


def settled(each: Sequence[Sequence[Power]], seconds: float) -> float:
    """Probability that the true set is distinguished from every rival after some seconds, with equal weights for sets and draws.

    each: powers of one draw of one set; sets without rivals are left out
    """
    judged = [item for item in each if item]
    if not judged:
        return 0.0
    truths = {item[0].truth for item in judged}
    chances = []
    for truth in sorted(truths):
        own = [min(one.probability(seconds) for one in item) for item in judged if item[0].truth == truth]
        chances.append(float(np.mean(own)))
    return float(np.mean(chances))


def seconds_needed(each: Sequence[Sequence[Power]], most: float) -> float:
    """s after which the sets are distinguished with 95 %; infinite if ``most`` seconds do not suffice."""
    if settled(each, most) < SURE:
        return math.inf
    low, high = 0.0, most
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if settled(each, middle) >= SURE else (middle, high)
    return high
