"""Innovations of the filter across a gap as a function of numbers that a solver can move, with their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.effects._contract import Beside, Effect, Parameter, in_time
from xy_sysid.effects.backlash.contact_filter import filter_with
from xy_sysid.effects.backlash.descent import Found, Patience, descend
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.samples.block import FloatArray

STIFF = 2.0 * np.pi * 180.0  # rad/s of the contact at least: flanks of steel; a softer one is a loosely held mass, not play in the drive
DRIFT = 0.3  # process noise per rms speed, 1/sqrt(s): the filter forgives this much acceleration
SANE = 0.5  # rad/s of the pole over the sampling rate, Hz, to begin with: a base that was led astray would make the filter unstable
SETTLED = 0.5  # s until the filter is judged
STEP = 1e-3  # of a number's unit, for derivatives of what is beside
WORST = 1e6  # innovation over the noise at which it is cut off
RATE, HERTZ, GAP = (NAMES.index(name) for name in ("rate", "hertz", "gap"))
SPEED = 0.025
MOST = 40  # sub-steps of a sample
STABLE = 0.7  # of what a contact's spring and damper turn in a sub-step, rad: twice as much and explicit steps run away
LOG = (False, False, True, True, False, True, False, False, False, False, False)  # by NAMES


@dataclass(frozen=True, slots=True)
class View:
    """What the filter is shown and told. looseness: factor on the process noise; cuts: sub-steps of each piece of a sample, at
    least; deaf: factor on the encoder's noise."""

    samples: int
    looseness: float = 1.0
    cuts: int = 6
    deaf: float = 1.0


class Innovations:
    """Over the noise, for coordinates: numbers, or their logarithms, in units.

    The numbers are those of the base and the contact by ``NAMES``, the parameters of each law of dry friction, and what is beside.
    """

    def __init__(self, sampling_rate: float, base: tuple[float, float, float], noise: float, beside: Beside, laws: tuple[Effect, ...]) -> None:
        self.fs, self.noise, self.beside, self.laws, self.count = sampling_rate, noise, beside, laws, [0]
        self.filter = filter_with(laws)
        rows = [row for effect in laws for row in _rows_of(effect)]
        self.friction = slice(len(NAMES), len(NAMES) + len(rows))
        self.others = slice(self.friction.stop, self.friction.stop + beside.start.size)
        longest = max(20.0 / sampling_rate, 2.0 * base[1])
        low = [-np.inf, 0.0, 1e-2, 1e-10, 0.02, STIFF/2, 0.0, 0.0, 0.0, 0.0, 0.0]
        high = [np.inf, longest, 1e5, 1e-2, 0.98, max(15.0 * sampling_rate, 2.0 * STIFF), 2.0, 500.0, 0.9, 1.0, 10.0]
        unit = [0.02 * abs(base[0]), 0.1 / sampling_rate, 0.05, 0.1, 0.05, 0.1, 0.05, 2.0, 0.02, 0.1, 0.02]
        self.log = np.array([*LOG, *(row.log for row in rows), *beside.positive], dtype=np.bool_)
        self.unit = np.array([*unit, *(row.unit for row in rows), *np.where(beside.positive, 0.05, 0.05 * beside.unit)])
        self.low = self.inner(np.array([*low, *(row.low for row in rows), *beside.low]))
        self.high = self.inner(np.array([*high, *(row.high for row in rows), *beside.high]))
        self.late = in_time
        self.heeded = np.arange(3)  # numbers of the base on which what is beside depends

    def softened(self, rate: float) -> Innovations:
        """The same, with a contact that may be as soft as that, rad/s; runs count for both."""
        other = copy(self)
        other.low = self.low.copy()
        other.low[RATE] = np.log(rate) / self.unit[RATE]
        return other

    def start(self, base: tuple[float, float, float], values: Sequence[float], friction: Sequence[float]) -> FloatArray:
        """Coordinates."""
        gain, delay, pole = base
        return self.inner(np.array([gain, delay, min(pole, SANE * self.fs), *values, *friction, *self.beside.start]))

    @property
    def runs(self) -> int:
        """How often the filter ran."""
        return self.count[0]

    def inner(self, numbers: FloatArray) -> FloatArray:
        """Coordinates of numbers."""
        return np.asarray(np.where(self.log, np.log(np.where(self.log, np.maximum(numbers, 1e-300), 1.0)), numbers) / self.unit)

    def outer(self, inner: FloatArray) -> FloatArray:
        """Numbers, within their bounds."""
        kept = np.clip(inner, self.low, self.high) * self.unit
        return np.asarray(np.where(self.log, np.exp(np.where(self.log, kept, 0.0)), kept))

    def seen(self, inner: FloatArray, view: View) -> FloatArray:
        """(samples,) innovations over the noise."""
        return self.run(self.outer(inner), view, False)[0]

    def size(self, inner: FloatArray, view: View) -> float:
        """rms of the innovations over the noise."""
        return float(np.sqrt(np.mean(self.seen(inner, view) ** 2)))

    def solved(self, start: FloatArray, free: NDArray[np.int64], view: View, most: int, enough: float) -> FloatArray:
        """Coordinates that make the innovations least, from a start, of which some are free; most, enough: see ``Patience``."""
        whole = start.copy()
        whole[free] = self._descended(start, free, view, most, enough).part
        return whole

    def spread(self, inner: FloatArray, view: View) -> FloatArray:
        """Standard errors of the numbers, from the innovations' slopes."""
        found = self._descended(inner, np.arange(inner.size), view, 0, 0.0)
        size = np.sqrt(np.maximum(np.diag(found.normal), 1e-300))
        covariance = np.linalg.pinv(found.normal / np.outer(size, size), rcond=1e-10, hermitian=True) / np.outer(size, size)
        own = np.sqrt(np.maximum(np.diag(covariance), 0.0) * found.cost) * self.unit
        return np.asarray(np.where(self.log, own * self.outer(inner), own))

    def _descended(self, start: FloatArray, free: NDArray[np.int64], view: View, most: int, enough: float) -> Found:
        skip = min(int(SETTLED * self.fs), view.samples // 4)
        inner = start.copy()

        def errors(part: FloatArray, sloped: bool) -> tuple[FloatArray, FloatArray]:
            inner[free] = part
            numbers = self.outer(inner)
            out, slopes = self.run(numbers, view, sloped)
            return out[skip:], slopes[skip:, free] if sloped else slopes

        return descend(errors, start[free], self.low[free], self.high[free], Patience(most, enough, self.late))

    def run(self, numbers: FloatArray, view: View, sloped: bool) -> tuple[FloatArray, FloatArray]:
        """(n,) innovations over the noise, and (n, coordinates) their derivatives, or (0, 0)."""
        self.count[0] += 1
        n = view.samples
        voltage, position, against, through = self._undone(numbers, n)
        column = np.zeros(0, dtype=np.int64)
        moved = np.zeros((0, n)), np.zeros((0, n + 1)), np.zeros((0, 2, n))
        passing = np.zeros(0)
        if sloped and self.others.start < self.others.stop:
            column, moved, passing = self._moved(numbers, n)
        noise = self.noise / through
        drift = (view.looseness * DRIFT * float(np.std(np.diff(position))) * self.fs) ** 2
        out, slopes = np.empty(n), np.empty((n, numbers.size) if sloped else (0, 0))
        own = numbers[: self.friction.stop].copy()
        nudge = 1e-6 * np.maximum(np.abs(own[self.friction]), 1e-3 * np.where(self.log[self.friction], 0.0, self.unit[self.friction]) + 1e-300)
        self.filter(
            voltage,
            position - position[0],
            against,
            own,
            self.fs,
            (view.deaf * noise) ** 2,
            drift,
            max(view.cuts, self._stable(numbers, float(np.std(voltage)))),
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
            with np.errstate(over="ignore", invalid="ignore"):  # a filter that runs away
                slopes *= self.unit * np.where(self.log, numbers, 1.0) / noise
            slopes[:, column] += np.outer(out, passing / through) * (self.unit * np.where(self.log, numbers, 1.0))[column]
            slopes = np.clip(np.nan_to_num(slopes, nan=0.0), -WORST, WORST)
        return out, slopes

    def _stable(self, numbers: FloatArray, volts: float) -> int:
        """Sub-steps of a sample with which explicit steps follow the contact's spring and damper; volts: rms of the drive, V."""
        depth = 0.3 * SPEED / numbers[RATE]
        swift = numbers[RATE] * np.sqrt(1.0 + numbers[HERTZ] * (1.5 * np.sqrt(2.0 * depth / numbers[GAP]) - 1.0))
        return min(int(np.ceil(swift / self.fs / STABLE)), MOST)

    def _undone(self, numbers: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        return self.beside.undo(np.concatenate((numbers[:3], numbers[self.others])), n)

    def _moved(self, numbers: FloatArray, n: int) -> tuple[NDArray[np.int64], tuple[FloatArray, FloatArray, FloatArray], FloatArray]:
        """Columns, and derivatives by their numbers of voltage, position and forces, and of what passes of a sudden change."""
        here = self._undone(numbers, n)
        column = np.array([*self.heeded, *range(self.others.start, self.others.stop)])
        steps = STEP * self.unit[column] * np.where(self.log[column], numbers[column], 1.0)
        rows = []
        for place, step in zip(column, steps, strict=True):
            moved = numbers.copy()
            moved[place] += step
            rows.append([(np.asarray(new) - old) / step for new, old in zip(self._undone(moved, n), here, strict=True)])
        heeds = [place >= 3 or any(np.any(item) for item in row) for place, row in zip(column, rows, strict=True)]
        self.heeded = column[[place < 3 and seen for place, seen in zip(column, heeds, strict=True)]]
        kept = [row for row, seen in zip(rows, heeds, strict=True) if seen]
        voltage, position, against, through = (np.array(items) for items in zip(*kept, strict=True))
        return column[heeds], (voltage, position, against), through


@dataclass(frozen=True, slots=True)
class _Row:
    low: float
    high: float
    unit: float
    log: bool


def _rows_of(effect: Effect) -> list[_Row]:
    """How the solver moves the parameters of a law: the first, its size, as it is, that it can vanish."""
    return [_row(item, place == 0) for place, item in enumerate(effect.parameters)]


def _row(item: Parameter, size: bool) -> _Row:
    if item.positive and not size:
        return _Row(item.low, item.high, 0.1, True)
    return _Row(item.low, item.high, 0.05 * (abs(item.typical) or min(1.0, item.high - item.low)), False)
