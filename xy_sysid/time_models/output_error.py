"""Output error: the parameters with the smallest error between simulation and measurement, with their uncertainty.

The residual error of a small model is not white noise. Therefore the covariance of the parameters is White's sandwich with the autocovariance of
the scores, up to the lag at which the error is uncorrelated (Newey & West, Econometrica 55, 1987; Ljung, System Identification, 2nd ed., sec. 9.3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy

from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table

FORGOTTEN = 0.1  # autocorrelation below which an error counts as uncorrelated
FLAT = 1e-5  # singular value of the scaled Jacobian, relative to the largest, below which the data do not determine a direction
STEP = 1e-5  # of a value or of its start, for derivatives
FURTHEST = 0.2  # of a record: longer lags cannot be estimated

Simulate = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True)
class Told:
    """A number with its 95 % interval; both ends are infinite if the data do not determine it."""

    name: str
    value: float
    low: float
    high: float
    unit: str = ""

    @property
    def told(self) -> bool:
        """True if the interval excludes zero."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high) and self.low * self.high > 0.0)


def told_table(items: Sequence[Told]) -> Table:
    """A row for each number."""
    return Table(("parameter", "value", "from", "to", "unit"), tuple((item.name, item.value, item.low, item.high, item.unit) for item in items))


@dataclass(frozen=True, slots=True)
class Minimized:
    """A minimum.

    values: (p,); covariance: (p, p), infinite on the diagonal for undetermined parameters; error: (n,) measured minus simulated
    independent: effective number of independent samples of the error; cost: rms of the error
    flatness: singular value of the least determined combination of scaled parameters, relative to the largest
    """

    values: FloatArray
    covariance: FloatArray
    error: FloatArray
    independent: float
    flatness: float

    @property
    def cost(self) -> float:
        """rms of the error."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def tells(self) -> bool:
        """True if the data determine every combination of parameters."""
        return self.flatness > FLAT

    def length(self, independent: float) -> float:
        """Description length, nats, for this many independent numbers: the error's cost, and each parameter's (Rissanen 1978, Schwarz 1978)."""
        return independent * float(np.log(max(self.cost, 1e-300))) + 0.5 * self.values.size * float(np.log(max(independent, 2.0)))

    def parameter(self, name: str, place: int, unit: str, low: float, high: float) -> Told:
        """A parameter with bounds; its interval is clipped to them."""
        found = self.quantity(name, float(self.values[place]), np.eye(self.values.size)[place], unit)
        return replace(found, low=max(found.low, low), high=min(found.high, high))

    def quantity(self, name: str, value: float, slope: FloatArray, unit: str = "", positive: bool = False) -> Told:
        """A function of the parameters with its interval, from its derivatives (p,); positive: the interval is that of its logarithm."""
        variance = float(slope @ self.covariance @ slope) if np.all(np.isfinite(self.covariance)) else np.inf
        if not np.isfinite(variance):
            return Told(name=name, value=value, low=0.0 if positive else -np.inf, high=np.inf, unit=unit)
        width = float(scipy.stats.t.ppf(0.975, max(self.independent - self.values.size, 1.0))) * np.sqrt(max(variance, 0.0))
        if positive and value > 0.0:
            factor = float(np.exp(min(width / value, 700.0)))
            return Told(name=name, value=value, low=value / factor, high=value * factor, unit=unit)
        return Told(name=name, value=value, low=float(value - width), high=float(value + width), unit=unit)


def shortest(found: Sequence[Minimized]) -> int:
    """Index of the solution with the shortest description, among those of one record whose parameters are all determined."""
    told = [k for k, item in enumerate(found) if item.tells] or [len(found) - 1]
    independent = max(found[k].independent for k in told)
    return min(told, key=lambda k: found[k].length(independent))


def solved(
    simulate: Simulate, starts: Sequence[FloatArray], measured: FloatArray, sizes: Sequence[int], low: FloatArray, high: FloatArray
) -> Minimized:
    """The best minimum from several starts.

    simulate: parameters (p,) -> (n,); measured: (n,), of recordings of these sizes one after the other; low, high: (p,) bounds
    """
    scale = np.maximum(np.abs(np.array(starts[0])), 1e-6)

    def error(values: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            found = measured - simulate(values)
        return np.nan_to_num(found, nan=1e6, posinf=1e6, neginf=-1e6)

    def slope(values: FloatArray) -> FloatArray:
        """(n, p) derivatives, by steps into the bounds that do not vanish with the value: a parameter that ends at 0 is still judged."""
        here, steps = error(values), STEP * np.maximum(np.abs(values), scale)
        steps = np.where(values + steps > high, -steps, steps)
        return np.column_stack([(error(values + row) - here) / step for row, step in zip(np.diag(steps), steps, strict=True)])

    found = [
        scipy.optimize.least_squares(error, np.clip(start, low, high), slope, bounds=(low, high), x_scale=scale, max_nfev=60) for start in starts
    ]
    best = min(found, key=lambda item: float(item.cost))
    return _judged(np.asarray(best.x), np.asarray(best.fun), -np.asarray(best.jac), sizes)


def _judged(values: FloatArray, error: FloatArray, slope: FloatArray, sizes: Sequence[int]) -> Minimized:
    """The minimum with its covariance; slope: (n, p) derivatives of the simulation."""
    norms = np.linalg.norm(slope, axis=0)
    seen = norms > 0.0
    edges = np.cumsum([0, *sizes])
    parts = [slice(int(a), int(b)) for a, b in pairwise(edges)]
    lags = _memory(error, parts)
    inflation = 1.0 + 2.0 * sum(_correlation(error, parts, lag) for lag in range(1, lags))
    count = float(seen.sum())
    independent = max(error.size / max(inflation, 1.0), count + 1.0)
    covariance = np.full((values.size, values.size), np.inf)
    flatness = 0.0
    if bool(seen.all()):
        sizes_of = np.linalg.svd(slope / norms, full_matrices=False)[1]
        flatness = float(sizes_of[-1] / sizes_of[0])
        if flatness > FLAT:
            inverse = np.linalg.inv((slope / norms).T @ (slope / norms))
            scores = (slope / norms) * error[:, None]
            meat = scores.T @ scores
            for lag in range(1, lags):
                for part in parts:
                    own = scores[part]
                    if own.shape[0] > lag:
                        cross = own[:-lag].T @ own[lag:]
                        meat += (1.0 - lag / lags) * (cross + cross.T)
            spread = inverse @ meat @ inverse * error.size / max(error.size - count, 1.0)
            covariance = spread / np.outer(norms, norms)
    return Minimized(values=values, covariance=covariance, error=error, independent=independent, flatness=flatness)


def _memory(error: FloatArray, parts: Sequence[slice]) -> int:
    """Number of samples after which the error is uncorrelated."""
    longest = max(part.stop - part.start for part in parts)
    most = max(int(FURTHEST * longest), 1)
    return next((lag for lag in range(1, most) if _correlation(error, parts, lag) < FORGOTTEN), most)


def _correlation(error: FloatArray, parts: Sequence[slice], lag: int) -> float:
    """Autocorrelation of the error at this lag, within recordings."""
    power = float(error @ error)
    shared = sum(float(error[part][:-lag] @ error[part][lag:]) for part in parts if part.stop - part.start > lag)
    return shared / power if power > 0.0 else 0.0
