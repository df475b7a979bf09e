"""Two masses that touch across a gap, followed sample by sample: an extended Kalman filter on the motor's position.

Contact is chaotic: free simulations of the same gap part within milliseconds, so a model with backlash can only be judged
by how well it predicts the next sample from what was measured up to now (one-step prediction; Ljung, System
Identification, 2nd ed., sec. 3.2; the filter: Jazwinski, Stochastic Processes and Filtering Theory, 1970, sec. 8.3).

State: motor position and speed, motor minus table, its rate. Flanks push as k depth (1 + loss speed) + c speed and never
pull (Hunt & Crossley, J. Appl. Mech. 42, 1975, eq. 8). The motor rubs by the laws of
Coulomb friction, Stribeck friction or presliding hysteresis; the deflection of the bristles follows the motor's position
and is corrected with it. Integrated by the explicit midpoint rule within each of a sample's two pieces of constant voltage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from xy_sysid.compiled import compiled
from xy_sysid.effects.contract import NO_FRICTION, Beside, DryFriction, Followed
from xy_sysid.effects.presliding_hysteresis import bend
from xy_sysid.effects.presliding_hysteresis import force as bristle_force
from xy_sysid.effects.stribeck_friction import level
from xy_sysid.stream import FloatArray

NAMES = ("gain", "delay", "pole", "gap", "share", "rate", "damping", "loss", "guide", "coulomb", "excess", "velocity", "length", "bristle_damping")
LOG = np.array([name in ("pole", "gap", "rate", "velocity", "length", "bristle_damping") for name in NAMES])
RUBBING = {"coulomb_friction": (9,), "stribeck_friction": (9, 10, 11), "presliding_hysteresis": (9, 12, 13)}  # places of their parameters
RUBBED, OWN = 9, len(NAMES)  # coordinates before those of friction, and before those of what is beside
USUAL = (0.0, 0.0, 0.01, 10e-6, 2.0)  # of these parameters, where they are not in use
GAPS = np.geomspace(2e-6, 150e-6, 10)  # m, tried first
STIFF = 2.0 * np.pi * 180.0  # rad/s of the contact at least: flanks of steel; a softer one is a loosely held mass, not play in the drive
SEEN = 2.5  # encoder noises that a gap must have to be one
WORTH_A_LOOK = 60.0  # innovation over noise after the first few steps above which the fit is given up
PROMISING = 10.0  # the same on the whole first stage; on the way to it twice that
DEAF = 12.0  # the filter is told this much more encoder noise on the way: a smoother valley
SLOW = 1e-3  # m/s at which the smoothed friction reaches its level
FAST = 18.0 * SLOW  # m/s above which nothing of that is left
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
        if fit.size(best, first, 1.0, 4) < PROMISING and np.exp(best[3]) > SEEN * noise:  # else it is no gap, whatever the rest may be
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
        high += np.log((1.0, 1e-2, 1e3)).tolist()
        unit = [0.02 * abs(base[0]), 0.1 / sampling_rate, 0.05, 0.1, 0.05, 0.1, 0.05, 2.0, 0.02, 0.01, 0.01, 0.1, 0.1, 0.1]
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
        """(14 + k,) standard errors of the parameters, from the innovations' slopes; 0 for those that are not in use."""
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


@compiled
def _push(depth_of: float, rate: float, half: float, k: float, c: float, loss: float) -> tuple[float, float, float]:
    """Force of the contact, and its derivatives by distance and by its rate."""
    if depth_of > half:
        depth = depth_of - half
        force = k * depth * (1.0 + loss * rate) + c * rate
        if force > 0.0:
            return force, k * (1.0 + loss * rate), k * depth * loss + c
    elif depth_of < -half:
        depth = depth_of + half
        force = k * depth * (1.0 - loss * rate) + c * rate
        if force < 0.0:
            return force, k * (1.0 - loss * rate), -k * depth * loss + c
    return 0.0, 0.0, 0.0


@compiled
def _rub(v: float, z: float, dry: float, excess: float, velocity: float, length: float, damping: float, bristles: bool) -> tuple[float, float, float]:
    """Friction in V, and its derivatives by speed and by position (bristles of deflection ``z`` follow it)."""
    if bristles:
        still = 1.0 - (z if v > 0.0 else -z) / length
        return bristle_force(dry, length, damping, z, v, 0.0), damping * still, dry / length * still
    steep = math.exp(-2.0 * abs(v) / SLOW) if abs(v) < FAST else 0.0
    smooth = math.copysign((1.0 - steep) / (1.0 + steep), v)  # tanh(v / SLOW), in a third of its time
    size = level(excess, dry, velocity, v) if excess > 0.0 else dry
    return size * smooth, size * (1.0 - smooth * smooth) / SLOW - 2.0 * v / (velocity * velocity) * (size - dry) * smooth, 0.0


@compiled
def innovations(
    u: FloatArray,
    y: FloatArray,
    against: FloatArray,
    values: FloatArray,
    bristles: bool,
    fs: float,
    noise: float,
    drift: float,
    cuts: int,
    out: FloatArray,
) -> None:
    """One pass of the filter: (n,) measured minus predicted position, m.

    u, against: (n,) V, against without delay; y: (n + 1,) m; values: by ``NAMES``; bristles: is friction theirs?
    noise: variance of the encoder, m^2; drift: of the speeds, m^2/s^3
    """
    gain, delay, pole, gap, share = values[0], values[1], values[2], values[3], values[4]
    reduced = share * (1.0 - share)
    k, c, loss = reduced * values[5] ** 2, 2.0 * reduced * values[6] * values[5], values[7]
    guide, dry, excess, velocity, length, bristle = values[8], values[9], values[10], values[11], values[12], values[13]
    per_volt, rubs = pole * abs(gain), dry + excess > 0.0
    drag_motor, drag_table = pole * (1.0 - guide), pole * guide
    per_motor, per_table = 1.0 / share, 1.0 / (1.0 - share)
    half = 0.5 * gap
    late = delay * fs
    whole = int(late)
    part = late - whole
    p = np.zeros((4, 4))
    b = np.zeros((4, 4))
    p[0, 0], p[1, 1], p[2, 2], p[3, 3] = noise, 1e-8, half * half + 1e-14, 1e-8
    x, v, d, w, z, zm = y[0], 0.0, 0.0, 0.0, 0.0, 0.0
    rub, slip, spring = 0.0, 0.0, 0.0
    for i in range(out.shape[0]):
        for piece in range(2):
            h = (part if piece == 0 else 1.0 - part) / fs / cuts
            if h <= 0.0:
                continue
            at = i - whole - 1 + piece
            push = pole * gain * ((u[at] if at >= 0 else 0.0) - against[i])
            for _ in range(cuts):
                force, _by_d, _by_w = _push(d, w, half, k, c, loss)
                if rubs:
                    rub = per_volt * _rub(v, z, dry, excess, velocity, length, bristle, bristles)[0]
                a = (push - rub - drag_motor * v - force) * per_motor
                r = a - (force - drag_table * (v - w)) * per_table
                vm, dm, wm = v + 0.5 * h * a, d + 0.5 * h * w, w + 0.5 * h * r
                force, by_d, by_w = _push(dm, wm, half, k, c, loss)
                if rubs:
                    if bristles:
                        zm = bend(dry, length, z, vm, 0.5 * h, 0.0)
                        z = bend(dry, length, zm, vm, 0.5 * h, 0.0)
                    rub, slip, spring = _rub(vm, zm, dry, excess, velocity, length, bristle, bristles)
                    rub, slip, spring = per_volt * rub, per_volt * slip, per_volt * spring
                a = (push - rub - drag_motor * vm - force) * per_motor
                r = a - (force - drag_table * (vm - wm)) * per_table
                x, v, d, w = x + h * vm, v + h * a, d + h * wm, w + h * r
                v_x = -spring * per_motor
                v_v, v_d, v_w = -(drag_motor + slip) * per_motor, -by_d * per_motor, -by_w * per_motor
                w_v, w_d, w_w = v_v + drag_table * per_table, v_d - by_d * per_table, v_w - (by_w + drag_table) * per_table
                for q in range(4):
                    b[0, q] = p[0, q] + h * p[1, q]
                    b[1, q] = p[1, q] + h * (v_x * p[0, q] + v_v * p[1, q] + v_d * p[2, q] + v_w * p[3, q])
                    b[2, q] = p[2, q] + h * p[3, q]
                    b[3, q] = p[3, q] + h * (v_x * p[0, q] + w_v * p[1, q] + w_d * p[2, q] + w_w * p[3, q])
                for q in range(4):
                    p[q, 0] = b[q, 0] + h * b[q, 1]
                    p[q, 1] = b[q, 1] + h * (v_x * b[q, 0] + v_v * b[q, 1] + v_d * b[q, 2] + v_w * b[q, 3])
                    p[q, 2] = b[q, 2] + h * b[q, 3]
                    p[q, 3] = b[q, 3] + h * (v_x * b[q, 0] + w_v * b[q, 1] + w_d * b[q, 2] + w_w * b[q, 3])
                p[1, 1] += drift * h
                p[1, 3] += drift * h
                p[3, 1] += drift * h
                p[3, 3] += 2.0 * drift * h
        seen = p[0, 0] + noise
        error = y[i + 1] - x
        out[i] = error
        k0, k1, k2, k3 = p[0, 0] / seen, p[1, 0] / seen, p[2, 0] / seen, p[3, 0] / seen
        if bristles:
            z += k0 * error * (1.0 - (z if v > 0.0 else -z) / length)
        x, v, d, w = x + k0 * error, v + k1 * error, d + k2 * error, w + k3 * error
        for q in range(4):
            b[0, q] = p[0, q]
        for q in range(4):
            p[0, q] -= k0 * b[0, q]
            p[1, q] -= k1 * b[0, q]
            p[2, q] -= k2 * b[0, q]
            p[3, q] -= k3 * b[0, q]
