"""Gap, masses and contact of an axis with backlash, from one-step prediction.

Contact is chaotic: free simulations of the same gap part within milliseconds, so a model with backlash can only be judged
by how well it predicts the next sample from what was measured up to now (one-step prediction; Ljung, System
Identification, 2nd ed., sec. 3.2). The filter that predicts is in ``contact_filter``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from xy_sysid.effects.contact_filter import NAMES, innovations
from xy_sysid.effects.contract import NO_FRICTION, Beside, DryFriction, Followed
from xy_sysid.stream import FloatArray

LOG = np.array([name in ("pole", "gap", "rate", "velocity", "length", "bristle_damping") for name in NAMES])
RUBBING = {"coulomb_friction": (9,), "stribeck_friction": (9, 10, 11), "presliding_hysteresis": (9, 12, 13), "asymmetric_friction": (9, 14)}  # places
RUBBED, OWN = 9, len(NAMES)  # coordinates before those of friction, and before those of what is beside
USUAL = (0.0, 0.0, 0.01, 10e-6, 2.0, 0.0)  # of these parameters, where they are not in use
GAPS = np.geomspace(2e-6, 150e-6, 10)  # m, tried first
STIFF = 2.0 * np.pi * 180.0  # rad/s of the contact at least: flanks of steel; a softer one is a loosely held mass, not play in the drive
SEEN, LEFT = 2.5, 1.5  # encoder noises, and innovations, that a gap must have to be one
WORTH_A_LOOK = 60.0  # innovation over noise after the first few steps above which the fit is given up
PROMISING = 10.0  # the same on the whole first stage; on the way to it twice that
DEAF = 12.0  # the filter is told this much more encoder noise on the way: a smoother valley
DRIFT = 0.3  # process noise per rms speed, 1/sqrt(s): the filter forgives this much acceleration
SANE = 0.5  # rad/s of the pole over the sampling rate, Hz, to begin with: a base that was led astray would make the filter unstable
STEP = 1e-2  # of a parameter's unit
TRUSTED = 0.5  # part of a step's change that the derivatives may have missed
SETTLED = 0.5  # s until the filter is judged


class Contact:
    """Gap, masses and contact from the innovations of the first samples, judged on those after the training."""

    frictions = tuple(RUBBING)

    def fit(
        self,
        sampling_rate: float,
        base: tuple[float, float, float],
        noise: float,
        stages: tuple[int, int, int],
        beside: Beside,
        dry: DryFriction = NO_FRICTION,
        begin: Followed | None = None,
    ) -> Followed:
        """See ``OneStep``."""
        first, training, n = stages
        fit = _Fit(sampling_rate, base, noise, beside, n, dry.effect)
        brief = min(first, int(6.0 * sampling_rate))
        fit.deaf = DEAF
        best = self._searched(fit, base, dry, brief) if begin is None else self._from(fit, begin, dry, brief)
        if fit.size(best, brief, 1.0, 2) < 2.0 * PROMISING:
            best = fit.solve(best, fit.every, first, 1.0, 4, 8)
        fit.deaf = 1.0
        without = np.empty(0)
        size = fit.size(best, first, 1.0, 4)
        if size < PROMISING and np.exp(best[3]) > max(SEEN, LEFT * size) * noise:  # else it is no gap, whatever the rest may be
            without = self._without(fit, best, base, dry, brief, n)[training:] * noise
        values, spread = fit.outer(best), fit.spread(best, first)
        return Followed(
            (float(values[0]), float(values[1]), float(values[2])),
            tuple(float(value) for value in values[3:9]),
            (float(spread[0]), float(spread[1]), float(spread[2])),
            tuple(float(value) for value in spread[3:9]),
            DryFriction(dry.effect, *(tuple(float(row[k]) for k in RUBBING[dry.effect]) for row in (values, spread))),
            (tuple(values[OWN:].tolist()), tuple(spread[OWN:].tolist())),
            fit.innovation(best, n, 1.0, 4) * noise,
            float(np.sqrt(np.mean(without**2))) if without.size else 0.0,
            noise,
            fit.runs,
        )

    def innovation(self, sampling_rate: float, found: Followed, beside: Beside, samples: int) -> FloatArray:
        """See ``OneStep``."""
        fit = _Fit(sampling_rate, found.base, found.noise, beside, samples, found.dry.effect)
        return fit.innovation(fit.start(found.base, found.values, found.dry), samples, 1.0, 2)

    @staticmethod
    def _searched(fit: _Fit, base: tuple[float, float, float], dry: DryFriction, brief: int) -> FloatArray:
        starts = []
        for gap in GAPS:
            start = fit.start(base, (gap, 0.4, 1500.0, 0.2, 5.0, 0.03), dry)
            starts.append((float(np.mean(fit.innovation(start, brief, 2.0, 2) ** 2)), start))
        best = min(starts, key=lambda item: item[0])[1]
        best = fit.solve(best, fit.every, brief, 2.0, 2, 15)
        return fit.solve(best, fit.every, brief, 1.0, 2, 40) if fit.size(best, brief, 2.0, 2) < WORTH_A_LOOK else best

    @staticmethod
    def _from(fit: _Fit, begin: Followed, dry: DryFriction, brief: int) -> FloatArray:
        start = fit.start(begin.base, begin.values, begin.dry if begin.dry.effect == dry.effect else dry)
        best = fit.solve(start, fit.every, brief, 2.0, 2, 15)
        return fit.solve(best, fit.every, brief, 1.0, 2, 30)

    @staticmethod
    def _without(fit: _Fit, best: FloatArray, base: tuple[float, float, float], dry: DryFriction, brief: int, n: int) -> FloatArray:
        """Innovations over the noise without a gap; any spring will do then."""
        fit.deaf, fit.low[5] = DEAF, np.log(10.0)
        rigid = fit.start(base, (1e-10, 0.4, 1500.0, 0.1, 0.0, 0.03), dry)
        rigid[OWN:] = best[OWN:]
        fixed = fit.every[fit.every != 3]
        rigid = fit.solve(rigid, fixed, brief, 2.0, 2, 15)
        rigid = fit.solve(rigid, fixed, brief, 1.0, 2, 20)
        rigid = fit.solve(rigid, fixed, brief, 1.0, 4, 6)
        fit.deaf = 1.0
        return fit.innovation(rigid, n, 1.0, 4)


class _Fit:
    """Least squares on the innovations over the noise."""

    def __init__(self, sampling_rate: float, base: tuple[float, float, float], noise: float, beside: Beside, samples: int, friction: str) -> None:
        self.fs, self.noise, self.beside, self.runs, self.deaf = sampling_rate, noise, beside, 0, 1.0
        _, position, _, _ = beside.undo(np.array([*base, *beside.start]), samples)
        self.speed = float(np.std(np.diff(position))) * sampling_rate
        longest = max(20.0 / sampling_rate, 2.0 * base[1])
        low = [-np.inf, 0.0, np.log(1e-2), np.log(1e-10), 0.02, np.log(STIFF), 0.0, 0.0, 0.0, 0.0, 0.0, *np.log((1e-5, 5e-7, 1e-3))]
        high = [np.inf, longest, np.log(1e5), np.log(1e-2), 0.98, np.log(max(5.0 * sampling_rate, 2.0 * STIFF)), 2.0, 500.0, 0.9, 5.0, 5.0]
        low.append(-0.99)
        high += [*np.log((1.0, 1e-2, 1e3)).tolist(), 0.99]
        unit = [0.02 * abs(base[0]), 0.1 / sampling_rate, 0.05, 0.1, 0.05, 0.1, 0.05, 2.0, 0.02, 0.01, 0.01, 0.1, 0.1, 0.1, 0.05]
        self.log = np.concatenate((LOG, beside.positive))
        self.unit = np.concatenate((unit, np.where(beside.positive, 0.05, 0.05 * beside.unit)))
        self.low, self.high = (
            np.concatenate((own, np.where(beside.positive, np.log(np.maximum(other, 1e-300)), other)))
            for own, other in ((low, beside.low), (high, beside.high))
        )
        self.friction = friction
        self.every = np.array([*range(RUBBED), *RUBBING[friction], *range(OWN, self.unit.size)])

    def start(self, base: tuple[float, float, float], values: Sequence[float], dry: DryFriction) -> FloatArray:
        """All coordinates."""
        gain, delay, pole = base
        numbers = np.array([gain, delay, min(pole, SANE * self.fs), *values, *USUAL, *self.beside.start])
        numbers[list(RUBBING[dry.effect])] = dry.values
        return self.inner(numbers)

    def inner(self, values: FloatArray) -> FloatArray:
        return np.where(self.log, np.log(np.where(self.log, np.maximum(values, 1e-300), 1.0)), values)

    def outer(self, inner: FloatArray) -> FloatArray:
        return np.where(self.log, np.exp(np.where(self.log, inner, 0.0)), inner)

    def innovation(self, inner: FloatArray, samples: int, looseness: float, cuts: int) -> FloatArray:
        """(samples,) over the noise."""
        self.runs += 1
        out = np.empty(samples)
        drift = (looseness * DRIFT * self.speed) ** 2
        values = self.outer(np.clip(inner, self.low, self.high))
        voltage, position, against, through = self.beside.undo(np.concatenate((values[:3], values[OWN:])), samples)
        noise = self.noise / through
        bristles = self.friction == "presliding_hysteresis"
        innovations(voltage, position - position[0], against, values[:OWN], bristles, self.fs, (self.deaf * noise) ** 2, drift, cuts, out)
        return np.clip(np.nan_to_num(out, nan=1e6 * noise), -1e6 * noise, 1e6 * noise) / noise

    def size(self, inner: FloatArray, samples: int, looseness: float, cuts: int) -> float:
        """rms of the innovations over the noise."""
        return float(np.sqrt(np.mean(self.innovation(inner, samples, looseness, cuts) ** 2)))

    def solve(self, start: FloatArray, free: NDArray[np.int64], samples: int, looseness: float, cuts: int, most: int) -> FloatArray:
        """The free coordinates that make the innovations least, from a start."""
        skip = min(int(SETTLED * self.fs), samples // 4)

        def whole(part: FloatArray) -> FloatArray:
            inner = start.copy()
            inner[free] = part * self.unit[free]
            return inner

        def left(part: FloatArray) -> FloatArray:
            return self.innovation(whole(part), samples, looseness, cuts)[skip:]

        bounds = (self.low[free] / self.unit[free], self.high[free] / self.unit[free])
        begin = np.clip(start[free] / self.unit[free], bounds[0] + 1e-9, bounds[1] - 1e-9)
        found = scipy.optimize.least_squares(left, begin, _Slopes(left), bounds, ftol=1e-4, xtol=1e-5, max_nfev=most)
        return whole(found.x)

    def spread(self, inner: FloatArray, samples: int) -> FloatArray:
        """(15 + k,) standard errors of the parameters, from the innovations' slopes; 0 for those that are not in use."""
        part = inner[self.every] / self.unit[self.every]

        def left(part: FloatArray) -> FloatArray:
            moved = inner.copy()
            moved[self.every] = part * self.unit[self.every]
            return self.innovation(moved, samples, 1.0, 4)

        slopes = _Slopes(left)(part)
        variance = float(np.mean(left(part) ** 2))
        normal = slopes.T @ slopes
        size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        covariance = np.linalg.pinv(normal / np.outer(size, size), rcond=1e-10, hermitian=True) / np.outer(size, size)
        inner_spread = np.zeros(inner.size)
        inner_spread[self.every] = np.sqrt(np.maximum(np.diag(covariance), 0.0) * variance) * self.unit[self.every]
        return np.asarray(np.where(self.log, inner_spread * self.outer(inner), inner_spread))


class _Slopes:
    """Derivatives by differences; brought up to date with a step that went as they said, else taken anew (Broyden 1965)."""

    def __init__(self, left: Callable[[FloatArray], FloatArray]) -> None:
        self.left = left
        self.last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def __call__(self, part: FloatArray) -> FloatArray:
        """(samples, k) at ``part`` (k,)."""
        here = self.left(part)
        columns = self._updated(part, here)
        if columns is None:
            columns = np.empty((here.size, part.size))
            for k in range(part.size):
                moved = part.copy()
                moved[k] += STEP
                columns[:, k] = (self.left(moved) - here) / STEP
        self.last = part.copy(), here, columns
        return columns

    def _updated(self, part: FloatArray, here: FloatArray) -> FloatArray | None:
        if self.last is None:
            return None
        before, then, columns = self.last
        step, change = part - before, here - then
        missing = change - columns @ step
        if not float(step @ step) > 0.0 or float(missing @ missing) > TRUSTED**2 * float(change @ change):
            return None
        return np.asarray(columns + np.outer(missing, step / float(step @ step)))
