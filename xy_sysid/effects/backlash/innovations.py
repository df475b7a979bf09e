"""Innovations of the filter across a gap as a function of fitted numbers, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.effects._contract import Companions, Effect, Parameter, in_time
from xy_sysid.effects._similarity import SPEED
from xy_sysid.effects.backlash.contact_filter import filter_with
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.samples.block import FloatArray

STIFF = 2.0 * np.pi * 90.0  # rad/s; half of it is the lower bound of the contact: a softer one is a loosely held mass, not steel flanks
DRIFT = 0.3  # process noise per rms speed, 1/sqrt(s): acceleration that the model may miss
SANE = 0.5  # largest start value of the pole, rad/s, over the sampling rate, Hz: a wrong base would make the filter unstable
SETTLED = 0.5  # s of settling, whose innovations do not count
STEP = 1e-3  # of a number's unit, for derivatives by the companions' parameters
WORST = 1e6  # innovation over the noise at which it is cut off
CLOSED = 1e-10  # m: no gap
TAILS = 3.0  # innovation over scale from which it counts less (Cauchy loss): the filter may briefly lose the state of the gap
NORMAL = 1.4826  # standard deviation over median magnitude of a normal distribution
MOST = 40  # largest number of sub-steps in a sample
PRESSED = 0.3  # typical impact speed of the flanks over ``SPEED``
LOG = (False, False, True, True, False, True, False, False, False, False, False)  # by NAMES
GAP, RATE, HERTZ = (NAMES.index(name) for name in ("gap", "rate", "hertz"))


@dataclass(frozen=True, slots=True)
class View:
    """Settings of a filter run.

    samples: number of samples from the first; process_noise_factor: factor on the process noise that the filter assumes
    sub_steps: least number in a sample; turn: largest phase of the closed contact in a sub-step, rad
    """

    samples: int
    process_noise_factor: float = 1.0
    sub_steps: int = 6
    turn: float = 0.35

    def within(self, samples: int) -> View:
        """The same settings with at most this number of samples."""
        return replace(self, samples=min(self.samples, samples))


class Innovations:
    """Innovations over the encoder noise, as a function of coordinates: scaled numbers, or scaled logarithms of them.

    The numbers are those of the base and the contact by ``NAMES``, the parameters of each law of dry friction, and those of the companions.
    """

    def __init__(
        self, sampling_rate: float, base: tuple[float, float, float], noise: float, companions: Companions, laws: tuple[Effect, ...]
    ) -> None:
        self.fs, self.noise, self.companions, self.laws = sampling_rate, noise, companions, laws
        self._ran: list[int] = []  # samples of each run of the filter, from any thread
        self.filter = filter_with(laws)
        rows = [row for effect in laws for row in _rows_of(effect)]
        self.friction = slice(len(NAMES), len(NAMES) + len(rows))
        self.others = slice(self.friction.stop, self.friction.stop + companions.start.size)
        longest = max(20.0 / sampling_rate, 2.0 * base[1])
        low = [-np.inf, 0.0, 1e-2, 0.1 * noise, 0.02, STIFF / 2, 0.0, 0.0, 0.0, 0.0, 0.0]
        high = [np.inf, longest, 1e5, 1e-2, 0.98, max(15.0 * sampling_rate, 4.0 * STIFF), 2.0, 500.0, 0.9, 1.0, 10.0]
        unit = [0.02 * abs(base[0]), 0.1 / sampling_rate, 0.05, 0.1, 0.05, 0.1, 0.05, 2.0, 0.02, 0.1, 0.02]
        self.log = np.array([*LOG, *(row.log for row in rows), *companions.positive], dtype=np.bool_)
        self.unit = np.array([*unit, *(row.unit for row in rows), *np.where(companions.positive, 0.05, 0.05 * companions.unit)])
        self.low = self.inner(np.array([*low, *(row.low for row in rows), *companions.low]))
        self.high = self.inner(np.array([*high, *(row.high for row in rows), *companions.high]))
        self.late = in_time
        self.influential = np.arange(3)  # numbers of the base on which the companions depend

    def with_soft_contact(self, rate: float) -> Innovations:
        """A copy that allows a gap of 0 and a contact as soft as ``rate``, rad/s; ``runs`` counts both."""
        other = copy(self)
        other.low = self.low.copy()
        other.low[[RATE, GAP]] = np.log((rate, CLOSED)) / self.unit[[RATE, GAP]]
        return other

    def start(self, base: tuple[float, float, float], values: Sequence[float], friction: Sequence[float]) -> FloatArray:
        """Coordinates of start values."""
        gain, delay, pole = base
        return self.inner(np.array([gain, delay, min(pole, SANE * self.fs), *values, *friction, *self.companions.start]))

    @property
    def runs(self) -> int:
        """Number of filter runs."""
        return len(self._ran)

    @property
    def filtered(self) -> int:
        """Samples of all filter runs."""
        return sum(self._ran)

    def inner(self, numbers: FloatArray) -> FloatArray:
        """Coordinates of numbers."""
        return np.asarray(np.where(self.log, np.log(np.where(self.log, np.maximum(numbers, 1e-300), 1.0)), numbers) / self.unit)

    def outer(self, inner: FloatArray) -> FloatArray:
        """Numbers, within their bounds."""
        kept = np.clip(inner, self.low, self.high) * self.unit
        return np.asarray(np.where(self.log, np.exp(np.where(self.log, kept, 0.0)), kept))

    def innovations(self, inner: FloatArray, view: View) -> FloatArray:
        """(samples,) innovations over the encoder noise."""
        return self.run(self.outer(inner), view, False)[0]

    def rms(self, inner: FloatArray, view: View) -> float:
        """rms of the innovations over the encoder noise."""
        return float(np.sqrt(np.mean(self.innovations(inner, view) ** 2)))

    def scale(self, errors: FloatArray) -> float:
        """Robust scale of the innovations over the encoder noise: 1.4826 times their median magnitude."""
        return NORMAL * float(np.median(np.abs(errors[self._skipped(errors.size) :])))

    def cost(self, errors: FloatArray, scale: float) -> float:
        """Mean of ln(1 + (error / (3 scale))^2), which a fit minimises."""
        return float(np.mean(np.log1p((errors[self._skipped(errors.size) :] / (TAILS * scale)) ** 2)))

    def solved(self, start: FloatArray, free: NDArray[np.int64], view: View, most: int, enough: float, scale: float | None = None) -> FloatArray:
        """Coordinates that minimise ``cost``, from ``start``; only those with an index in ``free`` change.

        most: largest number of steps; enough: relative fall of the cost at which it ends; scale: by default that of the start
        """
        whole, skip = np.clip(start, self.low, self.high), self._skipped(view.samples)
        inside = np.clip(start, self.low + 1e-6, self.high - 1e-6)[free]

        def errors(part: FloatArray) -> FloatArray:
            whole[free] = part
            return self.run(self.outer(whole), view, False)[0][skip:]

        def slopes(part: FloatArray) -> FloatArray:
            whole[free] = part
            return self.run(self.outer(whole), view, True)[1][skip:, free]

        size = scale or max(self.scale(self.innovations(start, view)), 1e-3)
        if self.late():
            return start
        found = scipy.optimize.least_squares(
            errors,
            inside,
            slopes,
            (self.low[free], self.high[free]),
            loss="cauchy",
            f_scale=TAILS * size,
            max_nfev=most,
            ftol=enough,
            xtol=1e-6,
            gtol=1e-12,
        )
        whole[free] = found.x
        return whole

    def spread(self, inner: FloatArray, view: View) -> FloatArray:
        """Standard errors of the numbers, from the derivatives of the innovations."""
        errors, slopes = self.run(self.outer(inner), view, True)
        skip = self._skipped(errors.size)
        normal = slopes[skip:].T @ slopes[skip:]
        size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        covariance = np.linalg.pinv(normal / np.outer(size, size), rcond=1e-10, hermitian=True) / np.outer(size, size)
        own = np.sqrt(np.maximum(np.diag(covariance), 0.0) * float(np.mean(errors[skip:] ** 2))) * self.unit
        return np.asarray(np.where(self.log, own * self.outer(inner), own))

    def _skipped(self, samples: int) -> int:
        return min(int(SETTLED * self.fs), samples // 8)

    def run(self, numbers: FloatArray, view: View, sloped: bool) -> tuple[FloatArray, FloatArray]:
        """(n,) innovations over the encoder noise, and (n, coordinates) their derivatives, or (0, 0) unless ``sloped``."""
        n = view.samples
        self._ran.append(n)
        voltage, position, against, through = self._undone(numbers, n)
        column = np.zeros(0, dtype=np.int64)
        moved = np.zeros((0, n)), np.zeros((0, n + 1)), np.zeros((0, 2, n))
        passing = np.zeros(0)
        if sloped and self.others.start < self.others.stop:
            column, moved, passing = self._derivatives(numbers, n)
        noise = self.noise / through
        drift = (view.process_noise_factor * DRIFT * float(np.std(np.diff(position))) * self.fs) ** 2
        out, slopes = np.empty(n), np.empty((n, numbers.size) if sloped else (0, 0))
        own = numbers[: self.friction.stop].copy()
        nudge = 1e-6 * np.maximum(np.abs(own[self.friction]), 1e-3 * np.where(self.log[self.friction], 0.0, self.unit[self.friction]) + 1e-300)
        self.filter(
            voltage,
            position - position[0],
            against,
            own,
            self.fs,
            noise**2,
            drift,
            max(view.sub_steps, self._sub_steps(numbers, view.turn)),
            *moved,
            column,
            nudge,
            out,
            slopes,
        )
        bad = ~(np.abs(out) < WORST * noise)
        out = np.where(bad, np.copysign(WORST * noise, np.nan_to_num(out, nan=1.0)), out) / noise
        if sloped:
            slopes[bad] = 0.0
            with np.errstate(over="ignore", invalid="ignore"):  # a filter that diverges
                slopes *= self.unit * np.where(self.log, numbers, 1.0) / noise
            slopes[:, column] += np.outer(out, passing / through) * (self.unit * np.where(self.log, numbers, 1.0))[column]
            slopes = np.clip(np.nan_to_num(slopes, nan=0.0), -WORST, WORST)
        return out, slopes

    def _sub_steps(self, numbers: FloatArray, turn: float) -> int:
        """Sub-steps of a sample with which the phase of the closed contact, at typical stiffness, advances by at most ``turn`` rad."""
        depth = PRESSED * SPEED / numbers[RATE]
        stiffer = 1.0 + numbers[HERTZ] * (1.5 * np.sqrt(2.0 * depth / numbers[GAP]) - 1.0)
        return min(int(np.ceil(numbers[RATE] * np.sqrt(max(stiffer, 0.0)) / self.fs / turn)), MOST)

    def _undone(self, numbers: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        return self.companions.undo(np.concatenate((numbers[:3], numbers[self.others])), n)

    def _derivatives(self, numbers: FloatArray, n: int) -> tuple[NDArray[np.int64], tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
        """Indices of the influential numbers, the derivatives of voltage, position and forces by them, and those of the fraction of a sudden
        change that the encoder shows at once."""
        here = self._undone(numbers, n)
        column = np.array([*self.influential, *range(self.others.start, self.others.stop)])
        steps = STEP * self.unit[column] * np.where(self.log[column], numbers[column], 1.0)
        rows = []
        for place, step in zip(column, steps, strict=True):
            moved = numbers.copy()
            moved[place] += step
            rows.append([(np.asarray(new) - old) / step for new, old in zip(self._undone(moved, n), here, strict=True)])
        matters = [place >= 3 or any(np.any(item) for item in row) for place, row in zip(column, rows, strict=True)]
        self.influential = column[[place < 3 and used for place, used in zip(column, matters, strict=True)]]
        kept = [row for row, used in zip(rows, matters, strict=True) if used]
        voltage, position, against, through = (np.array(items) for items in zip(*kept, strict=True))
        return column[matters], (voltage, position, against), through


@dataclass(frozen=True, slots=True)
class _Row:
    low: float
    high: float
    unit: float
    log: bool


def _rows_of(effect: Effect) -> list[_Row]:
    """Solver settings of a law's parameters; the first, its size, is not fitted as a logarithm, so that it can become 0."""
    return [_row(item, place == 0) for place, item in enumerate(effect.parameters)]


def _row(item: Parameter, size: bool) -> _Row:
    if item.positive and not size:
        return _Row(item.low, item.high, 0.1, True)
    return _Row(item.low, item.high, 0.05 * (abs(item.typical) or min(1.0, item.high - item.low)), False)
