"""Does plus voltage mean plus position? A test that gathers evidence from the first motion on, at any voltage.

Two models of each axis are fitted to the motion of the last seconds. In both, the displacement of a short interval is

    steady drift + what goes on of the two intervals before + sum of response_i * mean voltage of some intervals before

and the response to a plus voltage is never negative in one, and never positive in the other. Masses, friction, delays, lags and
encoders on the load side all answer first in the direction of the voltage. The axis is wired backwards if the negative model is
better by far more than chance: by EVIDENCE in log likelihood, and with at most half of the residual error, while the positive model
explains less than half of what is new in the motion.

The voltage is the excitation alone, without centring: the excitation does not depend on the motion, so no disturbance, falling
load or vibration of a resting axis can go along with it by itself. Only motion beyond the encoder's noise is judged, and only
motion that is slow enough for the intervals: at a frequency at which the delay is half a period, plus does move it to minus.

Source: generalized likelihood ratio test, S. M. Kay, Fundamentals of Statistical Signal Processing, vol. 2, 1998, chapter 6.
"""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.excitation.encoder_noise import BENT, EncoderNoise
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import ExcitationSettings

INTERVAL = 0.01  # s, unless positions come more seldom
LAGS = ((0, 1), (1, 2), (2, 3), (3, 4), (4, 6), (6, 8), (8, 12), (12, 16))  # first and end of the intervals before, which share one response
PAST = LAGS[-1][1]
SPANS = (50, 200)  # intervals that are looked at: a sign that turns shows in the short one, a low voltage in the long one
EVIDENCE = 20.0  # ratio of log likelihoods; right machines of all kinds, sticky, late, soft, loaded, have shown 13 at most
BETTER = 2.0  # times less residual power than the other, which explains less than this part itself
NORMAL = 3.0  # mean fourth power of normal numbers of variance 1
FINEST = 1e-6  # no model of a machine is better than this part of the power
FAST = 0.25  # greatest part of the new in steps that motion within an interval may have, beyond noise and a straight line
LEAST = 12  # intervals without which nothing is said
GAP = 5  # intervals without a position, after which it begins again


class SignCheck:
    """``sent`` and ``saw`` in the order in which they happen; ``saw`` gives the axes that go against their voltage."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self._number = len(settings.axes)
        self.use(settings)
        self.forget()

    def use(self, settings: ExcitationSettings) -> None:
        """Take the rate."""
        self._interval = max(round(INTERVAL * settings.rate), settings.step)  # samples

    def forget(self) -> None:
        """Start again, because nothing is known of what happened during a pause."""
        none = np.empty((0, self._number))
        self._ends, self._sums = np.empty(0), none  # of the excitation: counter, and V samples until there
        self._seqs, self._places, self._unsure = np.empty(0), none, none  # of the motion: counter, mean in m, what a step must have in m^2
        self._since = np.full(self._number, -np.inf)  # counter since which the voltage is the excitation
        self._looked = -np.inf

    def sent(self, seq: float, signal: FloatArray, guarded: FloatArray) -> None:
        """The excitation, (n, axes) V, whose first sample has this counter; guarded: (axes,) whether a guard has sent something else."""
        before = self._sums[-1] if len(self._sums) else np.zeros(self._number)
        first = int(np.searchsorted(self._ends, seq - (SPANS[-1] + 2 * PAST) * self._interval))
        self._ends = np.concatenate((self._ends[first:], (seq, seq + len(signal))))
        self._sums = np.concatenate((self._sums[first:], (before, before + signal.sum(axis=0))))
        self._since = np.where(guarded, seq + len(signal) + PAST * self._interval, self._since)

    def saw(self, seq: FloatArray, values: FloatArray, noise: EncoderNoise) -> list[int]:
        """Positions, (n, axes) in m, with their counters; noise: what the encoder has shown until here."""
        if self._seqs.size and seq[0] - self._seqs[-1] > GAP * self._interval:
            self.forget()
        first = int(np.searchsorted(self._seqs, seq[-1] - (SPANS[-1] + 3) * self._interval))
        self._seqs = np.concatenate((self._seqs[first:], [seq.mean()]))
        self._places = np.concatenate((self._places[first:], [values.mean(axis=0)]))
        self._unsure = np.concatenate((self._unsure[first:], [_unsure(values, noise.variance)]))
        if seq[-1] - self._looked < 2 * self._interval or not self._ends.size:
            return []
        self._looked = float(seq[-1])
        return [axis for axis in range(self._number) if self._backwards(axis, float(noise.still[axis]))]

    def _backwards(self, axis: int, still: float) -> bool:
        last = self._seqs[-1]
        begin = max(self._seqs[0], self._ends[0], self._since[axis])
        number = int((last - begin) // self._interval)
        if number < LEAST or np.ptp(self._places[:, axis]) <= still:
            return False
        grid = last - self._interval * np.arange(number, -1, -1.0)
        steps = np.diff(np.interp(grid, self._seqs, self._places[:, axis]))
        longer = last - self._interval * np.arange(number + PAST, -1, -1.0)
        sums = np.interp(longer, self._ends, self._sums[:, axis]) / self._interval
        if np.ptp(sums) == 0:
            return False
        now = PAST + np.arange(number)
        responses = np.column_stack([sums[now + 1 - near] - sums[now + 1 - far] for near, far in LAGS])
        unsure = np.interp(grid[1:], self._seqs, self._unsure[:, axis])
        return any(_against(steps, responses, unsure, span) for span in SPANS if number >= span or span == SPANS[0])


def _unsure(values: FloatArray, noise: FloatArray) -> FloatArray:
    """(axes,) m^2 that a step must have to tell something: of the noise, and of the motion of (n, axes) positions about their straight line."""
    number = len(values)
    unsure = BENT * noise / number
    if number < 3:
        return unsure
    line, centred = np.arange(number) - (number - 1) / 2, values - values.mean(axis=0)
    power = np.mean(centred * centred, axis=0) - (line @ centred) ** 2 / (number * float(line @ line))
    return np.asarray(unsure + np.maximum(power - noise * (number - 2) / number, 0.0) / FAST**2, dtype=np.float64)


def _against(steps: FloatArray, responses: FloatArray, unsure: FloatArray, span: int) -> bool:
    """Whether a negative response explains the newest steps so much better than a positive one.

    steps: (n,) m; responses: (n, lags) V; unsure: (n,) m^2
    """
    known = np.column_stack((np.ones(len(steps) - 2), steps[1:-1], steps[:-2]))[-span:]
    basis, _ = np.linalg.qr(known)
    both = np.column_stack((steps[2:], responses[2:]))[-span:]
    both = both - basis @ (basis.T @ both)
    scale = np.sqrt(np.mean(both * both, axis=0))
    if not (scale > 0).all() or scale[0] ** 2 < np.mean(unsure[-span:]):
        return False
    both = both / scale
    step, told = both[:, 0], both[:, 1:]
    fits = [scipy.optimize.nnls(sign * told, step) for sign in (1.0, -1.0)]
    plus, minus = (float(residual) ** 2 for _, residual in fits)
    if plus < len(step) / BETTER or plus < BETTER * minus:
        return False
    rest = step - told @ fits[0][0]
    alike = max(float(rest[1:] @ rest[:-1]) / plus, 0.0)  # slow motion tells less than it has steps
    jerks = NORMAL * len(step) / float(np.mean(step**4))  # and so does motion of a few jerks
    free = min(jerks, len(step)) * (1 - alike) / (1 + alike) - known.shape[1] - np.count_nonzero(fits[1][0])
    return bool(0.5 * free * np.log(plus / max(minus, FINEST * plus)) > EVIDENCE)
