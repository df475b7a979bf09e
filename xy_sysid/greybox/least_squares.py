"""Levenberg-Marquardt on the whitened error in velocity: the fit that minimises the objective.

Levenberg 1944, Marquardt 1963. The error is divided by its spectrum according to the objective (``objective.spectrum``), which is computed
again before each round: iteratively reweighted least squares. A round that does not lower the objective is undone, so a fit
never ends worse than it starts.
Derivatives are forward differences of the simulation. They are computed again only if a step did not lower the cost as predicted, and are
otherwise updated with the result of the step (Broyden 1965).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from xy_sysid.effects._contract import in_time
from xy_sysid.greybox.floor import Bands, Floor, Windows, tolerance
from xy_sysid.greybox.objective import Objective
from xy_sysid.jit import on_all_cores
from xy_sysid.samples.block import FloatArray

TRUSTED = 0.25  # relative difference from the expected decrease below which no new derivatives are computed; with 0.75 long valleys take longer
EASED = 0.2  # factor of the damping after a step that succeeded
HIGHEST_DAMPING = 1e6  # a round whose steps are shorter has ended
EXPONENT = 700.0  # where an exponential ends
STEP = 1e-4  # of a logarithm, or of a parameter's scale: far above rounding errors, small enough for linearity


@dataclass(frozen=True, slots=True)
class Schedule:
    """When a solution ends.

    rounds, steps: most sets of weights, and most steps with each; enough: relative fall of the cost that ends a round;
    settled: nats a line; a round that gains less is the last; late: once True, the solution ends after the present step
    """

    rounds: int
    steps: int
    enough: float
    settled: float
    late: Callable[[], bool] = in_time


@dataclass(frozen=True, slots=True)
class Scale:
    """Scaling of each parameter: low, high: bounds; positive: True for a logarithm; unit: otherwise the size of 1 in the solver."""

    low: FloatArray
    high: FloatArray
    positive: NDArray[np.bool_]
    unit: FloatArray

    def inner(self, values: FloatArray) -> FloatArray:
        """The solver's coordinates."""
        safe = np.where(self.positive, np.clip(values, self.low, self.high), 1.0)
        return np.where(self.positive, np.log(safe), values / self.unit)

    def outer(self, inner: FloatArray) -> FloatArray:
        """Parameters, kept within their bounds."""
        values = np.where(self.positive, np.exp(np.where(self.positive, np.clip(inner, -EXPONENT, EXPONENT), 0.0)), inner * self.unit)
        return np.asarray(np.clip(values, self.low, self.high))


@dataclass(frozen=True)
class Target:
    """Data of a fit: velocity (n,), m/s, and the windows of it that count."""

    velocity: FloatArray
    windows: Windows
    least: Floor

    @cached_property
    def measured(self) -> NDArray[np.complex128]:
        """(windows, lines) spectrum of the velocity."""
        return self.windows.spectrum(self.velocity)

    @cached_property
    def objective(self) -> Objective:
        """The objective for this floor."""
        return Objective.of(self.least)

    def spectrum(self, error: NDArray[np.complex128]) -> tuple[FloatArray, float]:
        """(bands,) expected power of an error (windows, lines), and the error's score, nats a line; infinite for a diverging model."""
        power = self.windows.layout.power(error)
        expected = self.objective.spectrum(power)
        return expected, self.objective.score(power, expected)


Predictor = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Solution:
    """values: (k,) parameters; cost: whitened; score: objective, nats a line; runs: number of simulations.

    run, target: the problem; error: (windows, lines) spectrum of the residual error, m/s; change: (k, windows, lines) its last derivatives by the
    solver's coordinates; weight: (lines,) of the last round; normal: (k, k) products of the whitened derivatives
    """

    values: FloatArray
    cost: float
    score: float
    runs: int
    converged: bool
    run: Predictor
    target: Target
    error: NDArray[np.complex128]
    change: NDArray[np.complex128]
    weight: FloatArray
    normal: FloatArray

    @cached_property
    def covariance(self) -> FloatArray:
        """(k, k) covariance of the solver's coordinates."""
        windows, least, layout = self.target.windows, self.target.least, self.target.windows.layout
        noise, whitened = _covariance(self.normal), self.change * self.weight
        with np.errstate(over="ignore", invalid="ignore"):  # all error of a diverging model is one common error
            beyond = layout.lines * np.maximum(layout.power(self.error) - least.noise, 0.0)
            share = np.nan_to_num(beyond / tolerance(layout, self.error, least), nan=1.0, posinf=1.0)
        repeats = 1.0 + (windows.begins.size - 1) * share
        known = _with_repeated_error(whitened, np.sqrt(repeats)[layout.band], noise)
        return known + model_error_covariance(whitened, least.epsilon * self.target.measured * self.weight, layout, noise)


@dataclass(frozen=True, slots=True)
class _Point:
    """Where a search is.

    inner: (k,) the solver's coordinates; error: (windows, lines) and its derivatives change: (k, windows, lines); exact: False if updated only
    """

    inner: FloatArray
    error: NDArray[np.complex128]
    change: NDArray[np.complex128]
    exact: bool

    def equations(self, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(k, k) products of the whitened derivatives, and (k,) their products with the error."""
        with np.errstate(over="ignore", invalid="ignore"):  # a trial model may diverge
            columns = (self.change * weight).reshape(self.inner.size, -1).view(np.float64)
            return columns @ columns.T, columns @ (self.error * weight).ravel().view(np.float64)


@dataclass(frozen=True, slots=True)
class _Round:
    """The end of a round with one set of weights: see ``Solution``."""

    point: _Point
    cost: float
    normal: FloatArray
    converged: bool = False


class _Simulations:
    """Errors of parameters, and their derivatives; runs: number of simulations."""

    def __init__(self, run: Predictor, target: Target, scale: Scale) -> None:
        self._run, self._target, self.scale, self.runs = run, target, scale, 0

    def error(self, inner: FloatArray) -> NDArray[np.complex128]:
        self.runs += 1
        return self._error(inner)

    def _error(self, inner: FloatArray) -> NDArray[np.complex128]:
        return np.asarray(self._target.measured - self._target.windows.spectrum(self._run(self.scale.outer(inner))))

    def slopes(self, inner: FloatArray, error: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Derivatives of the error by forward differences."""
        self.runs += inner.size

        def slope(k: int) -> NDArray[np.complex128]:
            step = STEP if self.scale.outer(inner)[k] < self.scale.high[k] else -STEP
            moved = inner.copy()
            moved[k] += step
            return np.asarray((self._error(moved) - error) / step)

        return np.array(on_all_cores(slope, range(inner.size)))


def solve(
    run: Predictor,
    target: Target,
    scale: Scale,
    start: FloatArray,
    schedule: Schedule,
    known: Solution | None = None,
) -> Solution:
    """The parameters with the smallest error for a target.

    run: parameters -> velocity (n,), called from several threads at once; schedule: when to end;
    known: an earlier solution that ended at ``start``: its derivatives are used as an approximation, and its error if it had the same ``run``
    """
    simulated, inner = _Simulations(run, target, scale), scale.inner(start)
    error = known.error if known is not None and known.run is run else simulated.error(inner)
    here = _Point(inner, error, simulated.slopes(inner, error) if known is None else known.change, known is None)
    expected, score = target.spectrum(error)
    weight, ended = _weight(target, expected), _Round(here, np.inf, np.eye(inner.size))
    for _ in range(schedule.rounds):
        ended = _round(simulated, here, weight, schedule)
        expected, now = target.spectrum(ended.point.error)
        if not now < score:
            break
        gained, here, score, weight = score - now, ended.point, now, _weight(target, expected)
        if gained < schedule.settled:
            break
    return Solution(
        values=scale.outer(here.inner),
        cost=ended.cost,
        score=score,
        runs=simulated.runs,
        converged=ended.converged,
        run=run,
        target=target,
        error=here.error,
        change=here.change,
        weight=weight,
        normal=ended.normal,
    )


def _round(simulated: _Simulations, here: _Point, weight: FloatArray, schedule: Schedule) -> _Round:
    """Steps with one set of weights: Levenberg-Marquardt."""
    cost, damping, stale, normal, slope = _cost(here.error * weight), 1e-3, True, np.eye(here.inner.size), here.inner
    for _ in range(schedule.steps):
        if stale:
            normal, slope = here.equations(weight)
            stale = False
        if schedule.late() or not (np.all(np.isfinite(normal)) and np.any(normal)):  # a diverging model, or one that does not move
            break
        diagonal = np.maximum(np.diag(normal), 1e-12 * float(np.max(np.diag(normal))) + 1e-300)
        trial = _trial(here.inner, normal + damping * np.diag(diagonal), slope, simulated.scale)
        error = simulated.error(trial)
        new = _cost(error * weight)
        if np.isfinite(new) and new < cost:
            taken, fall = trial - here.inner, cost - new
            expected = -float(2.0 * slope @ taken + taken @ normal @ taken)
            exact = not abs(fall - expected) < TRUSTED * expected
            change = simulated.slopes(trial, error) if exact else _updated(here.change, taken, diagonal, error - here.error)
            here, stale, damping = _Point(trial, error, change, exact), True, max(damping * EASED, 1e-9)
            cost, settled = new, fall / cost < schedule.enough
            if settled:
                return _Round(here, cost, normal, True)
        elif not here.exact:
            here, stale = replace(here, change=simulated.slopes(here.inner, here.error), exact=True), True
        else:
            damping *= 10.0
            if damping > HIGHEST_DAMPING:
                return _Round(here, cost, normal, True)
    return _Round(here, cost, normal)


def _trial(inner: FloatArray, normal: FloatArray, slope: FloatArray, scale: Scale) -> FloatArray:
    """(k,) the solver's coordinates after a step of at most 2, within the bounds."""
    move = _move(normal, slope, scale, scale.outer(inner))
    move *= min(1.0, 2.0 / float(np.max(np.abs(move)) + 1e-300))
    return scale.inner(scale.outer(inner + move))


def _move(normal: FloatArray, slope: FloatArray, scale: Scale, values: FloatArray) -> FloatArray:
    """(k,) step of the solver's coordinates; a parameter at a bound that would cross it is held, and the step is that of the others."""
    free = np.ones(values.size, dtype=np.bool_)
    move = np.zeros(values.size)
    for _ in range(values.size):
        move = np.zeros(values.size)
        move[free] = -np.linalg.solve(normal[np.ix_(free, free)], slope[free])
        leaves = ((values <= scale.low) & (move < 0.0)) | ((values >= scale.high) & (move > 0.0))
        if not np.any(leaves) or np.all(leaves | ~free):
            break
        free &= ~leaves
    return np.where(free, move, 0.0)


def _weight(target: Target, expected: FloatArray) -> FloatArray:
    """(lines,) weight of an error (windows, lines), from its expected power (bands,)."""
    counts = target.objective.lines > 0.0
    return np.asarray((counts / np.sqrt(expected))[target.windows.layout.band])


def _updated(change: NDArray[np.complex128], taken: FloatArray, size: FloatArray, moved: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Derivatives (k, windows, lines), changed only to agree with the step just taken (Broyden 1965, eq. 4.5).

    taken: (k,) step; size: (k,) its weights; moved: resulting change of the error
    """
    missing = moved - np.tensordot(taken, change, 1)
    return np.asarray(change + np.multiply.outer(size * taken / float(size @ taken**2), missing))


def _covariance(normal: FloatArray) -> FloatArray:
    """Inverse of the normal matrix; infinite for a parameter without influence on the data."""
    if not np.all(np.isfinite(normal)):  # a diverging model
        return np.full(normal.shape, np.inf)
    spread = np.sqrt(np.diag(normal))
    seen = spread > 0.0
    covariance = np.diag(np.where(seen, 0.0, np.inf))
    unit = np.outer(spread[seen], spread[seen])
    covariance[np.ix_(seen, seen)] = np.linalg.pinv(normal[np.ix_(seen, seen)] / unit, rcond=1e-12, hermitian=True) / unit
    return covariance


def _with_repeated_error(change: NDArray[np.complex128], times: FloatArray, noise: FloatArray) -> FloatArray:
    """(k, k) covariance if the residual error of a band above encoder noise is one common error, in the worst case for its size.

    Noise averages out over lines and windows, such an error does not. change: (k, windows, lines), whitened; times: (lines,) square root
    of the number of windows with the same error; noise: (k, k) covariance if all were independent. Sandwich of White 1982 (eq. 3.2), with bands as
    clusters of one common error (Kennedy & O'Hagan 2001).
    """
    seen = np.isfinite(np.diag(noise))
    if not np.any(seen):
        return noise
    columns = np.ascontiguousarray(change[seen] * times).reshape(int(seen.sum()), -1).view(np.float64)
    found = noise.copy()
    found[np.ix_(seen, seen)] = noise[np.ix_(seen, seen)] @ (columns @ columns.T) @ noise[np.ix_(seen, seen)]
    return found


def model_error_covariance(change: NDArray[np.complex128], motion: NDArray[np.complex128], layout: Bands, noise: FloatArray) -> FloatArray:
    """(k, k) contribution of inexact laws and integration to the covariance; it does not fall with the length of the record.

    In each band the model's motion may be wrong by one common complex factor. change: (k, windows, lines), whitened; motion: (windows, lines),
    whitened, times that factor's size.
    """
    lines = np.einsum("kwl,wl->kl", change.conj(), motion)
    pulls = np.stack([np.bincount(layout.band, part, layout.count) for row in lines for part in (row.real, row.imag)])
    pulls = pulls.reshape(lines.shape[0], -1)
    seen = np.isfinite(np.diag(noise))
    found = np.zeros_like(noise)
    shifts = noise[np.ix_(seen, seen)] @ pulls[seen]
    found[np.ix_(seen, seen)] = 0.5 * shifts @ shifts.T
    return found


def _cost(error: NDArray[np.complex128]) -> float:
    return float(np.vdot(error, error).real)
