"""Does plus voltage mean plus position? A test that collects evidence from the first motion on, at any voltage.

Two models of each axis are fitted to the motion of the last seconds. In both, the displacement of a short interval is

    constant drift + a combination of the two displacements before + sum of response_i * mean voltage of some intervals before

and the response to a plus voltage is never negative in one, and never positive in the other. Axes with mass, friction, delay, lag
or an encoder on the load side all move first in the direction of the voltage. The axis is wired backwards if the negative model is
better by EVIDENCE in log likelihood, far above chance, and has at most half of the residual power, while the positive model
explains less than half of the new motion.

The voltage is the excitation alone, without centring: it does not depend on the motion, so no disturbance, falling load or
vibration of a resting axis correlates with it. Only motion above the encoder's noise is judged, and only motion that is slow
enough for the intervals: at a frequency at which the delay is half a period, plus voltage does move the axis to minus.

Source: generalized likelihood ratio test, S. M. Kay, Fundamentals of Statistical Signal Processing, vol. 2, 1998, chapter 6.
"""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.excitation.encoder_noise import BENT, EncoderNoise
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import ExcitationSettings

INTERVAL = 0.01  # s, longer if a block is longer
LAGS = ((0, 1), (1, 2), (2, 3), (3, 4), (4, 6), (6, 8), (8, 12), (12, 16))  # first and end of past intervals that share one response
PAST = LAGS[-1][1]
SPANS = (50, 200)  # intervals of two tests: the short one shows a changed sign, the long one a low voltage
EVIDENCE = 20.0  # log likelihood ratio; correctly wired machines with friction, delay, resonances or loads have shown 13 at most
BETTER = 2.0  # least ratio of residual powers, and of the power to the residual power of the positive model
NORMAL = 3.0  # mean fourth power of normal numbers of variance 1
FINEST = 1e-6  # of the power: least residual power of a model
FAST = 0.25  # of the new part of steps: most motion within an interval, beyond noise and a straight line
LEAST = 12  # least intervals for a test
GAP = 5  # intervals without a position, after which the test restarts


class SignCheck:
    """Call ``sent`` and ``saw`` in the order of events; ``saw`` returns the axes that move against their voltage."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self._number = len(settings.axes)
        self.use(settings)
        self.forget()

    def use(self, settings: ExcitationSettings) -> None:
        """Take the interval from the settings."""
        self._interval = max(round(INTERVAL * settings.rate), settings.step)  # samples

    def forget(self) -> None:
        """Restart after a pause, in which the motion is unknown."""
        none = np.empty((0, self._number))
        self._ends, self._sums = np.empty(0), none  # of the excitation: counter, and V samples until there
        self._seqs, self._places, self._unsure = np.empty(0), none, none  # of the motion: counter, mean in m, least power of a step in m^2
        self._since = np.full(self._number, -np.inf)  # counter since which the voltage is the excitation
        self._looked = -np.inf

    def sent(self, seq: float, signal: FloatArray, guarded: FloatArray) -> None:
        """Store excitation, (n, axes) V; seq: counter of its first sample; guarded: (axes,) whether a guard changed the voltage."""
        before = self._sums[-1] if len(self._sums) else np.zeros(self._number)
        first = int(np.searchsorted(self._ends, seq - (SPANS[-1] + 2 * PAST) * self._interval))
        self._ends = np.concatenate((self._ends[first:], (seq, seq + len(signal))))
        self._sums = np.concatenate((self._sums[first:], (before, before + signal.sum(axis=0))))
        self._since = np.where(guarded, seq + len(signal) + PAST * self._interval, self._since)

    def saw(self, seq: FloatArray, values: FloatArray, noise: EncoderNoise) -> list[int]:
        """Check positions, (n, axes) in m, with their counters; returns the axes with a wrong sign. noise: of the encoder so far."""
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
    """(axes,) m^2, least power of a step to be judged: from the noise, and from the motion of (n, axes) positions about a straight line."""
    number = len(values)
    unsure = BENT * noise / number
    if number < 3:
        return unsure
    line, centred = np.arange(number) - (number - 1) / 2, values - values.mean(axis=0)
    power = np.mean(centred * centred, axis=0) - (line @ centred) ** 2 / (number * float(line @ line))
    return np.asarray(unsure + np.maximum(power - noise * (number - 2) / number, 0.0) / FAST**2, dtype=np.float64)


def _against(steps: FloatArray, responses: FloatArray, unsure: FloatArray, span: int) -> bool:
    """Whether a negative response explains the newest ``span`` steps better than a positive one by EVIDENCE.

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
    alike = max(float(rest[1:] @ rest[:-1]) / plus, 0.0)  # steps of slow motion are correlated
    jerks = NORMAL * len(step) / float(np.mean(step**4))  # motion of a few jerks has fewer independent steps too
    free = min(jerks, len(step)) * (1 - alike) / (1 + alike) - known.shape[1] - np.count_nonzero(fits[1][0])
    return bool(0.5 * free * np.log(plus / max(minus, FINEST * plus)) > EVIDENCE)
