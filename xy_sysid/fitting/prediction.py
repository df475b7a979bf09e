"""The prediction on the lines and its analytic Jacobian, compiled.

Parameters: numerator b (m + 1) and denominator a (n + 1, the last one fixed) in an Arnoldi basis, and the delay.
    d(N / D) / db_i = p_i / D,   d(N / D) / da_i = -(N / D) p_i / D,   d / d(delay) = -s
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.compiled import compiled
from xy_sysid.fitting.basis import Basis
from xy_sysid.fitting.plan import Plan
from xy_sysid.frf import ComplexArray
from xy_sysid.hold import ALIASES, SERIES, TAIL_POINTS, tail_sums
from xy_sysid.stream import FloatArray

TAIL_REACH = 0.5  # the series in 1 / s is used while every pole is within this part of the last alias


@dataclass(frozen=True, slots=True)
class Model:
    """A plan with a basis: what is needed to evaluate parameters on it.

    numerator, denominator: the bases; *_grid, *_line, *_alias: their values; *_top: (order + 1, SERIES) their highest powers
    """

    plan: Plan
    integrators: int
    numerator: Basis
    denominator: Basis
    numerator_grid: ComplexArray
    denominator_grid: ComplexArray
    numerator_alias: ComplexArray
    denominator_alias: ComplexArray
    numerator_top: FloatArray
    denominator_top: FloatArray


def model_for(plan: Plan, integrators: int, numerator: Basis, denominator: Basis) -> Model:
    """Evaluate two bases wherever the plan needs them."""
    return Model(
        plan,
        integrators,
        numerator,
        denominator,
        numerator.values(plan.grid),
        denominator.values(plan.grid),
        numerator.values(plan.alias),
        denominator.values(plan.alias),
        _top(numerator),
        _top(denominator),
    )


def _top(part: Basis) -> FloatArray:
    """(order + 1, SERIES): coefficients of x^order, x^(order - 1), ... of each polynomial."""
    table = part.powers()[:, ::-1]
    out = np.zeros((table.shape[0], SERIES))
    width = min(SERIES, table.shape[1])
    out[:, :width] = table[:, :width]
    return out


def predict(model: Model, b: FloatArray, a: FloatArray, delay: float, jacobian: bool) -> ComplexArray:
    """(lines, 1) predicted response, or (lines, 1 + (m + 1) + n + 1) with the derivatives to b, a[:-1] and the delay."""
    plan = model.plan
    return _predict(
        b, a, delay, jacobian, model.integrators, plan.scale, plan.period, plan.omega, plan.main, plan.fold,
        plan.index, plan.conjugate, plan.kernel, plan.alias, plan.alias_factor, plan.alias_number, plan.spread, plan.tail,
        model.numerator_grid, model.denominator_grid, model.numerator_alias, model.denominator_alias,
        model.numerator_top, model.denominator_top,
    )  # fmt: skip


@compiled
def _row(
    out: NDArray[np.complex128], n_values: NDArray[np.complex128], d_values: NDArray[np.complex128], b: NDArray[np.float64],
    a: NDArray[np.float64], factor: complex, s: complex, jacobian: bool,
) -> None:  # fmt: skip
    """Add factor * (N / D and its derivatives; to the delay with this s) to a row."""
    top, bottom = 0.0 + 0.0j, 0.0 + 0.0j
    for i in range(b.shape[0]):
        top += b[i] * n_values[i]
    for i in range(a.shape[0]):
        bottom += a[i] * d_values[i]
    if bottom == 0.0:
        bottom = 1e-300 + 0.0j
    inverse = factor / bottom
    value = top * inverse
    out[0] += value
    if jacobian:
        for i in range(b.shape[0]):
            out[1 + i] += n_values[i] * inverse
        ratio = -value / bottom
        for i in range(a.shape[0] - 1):
            out[1 + b.shape[0] + i] += d_values[i] * ratio
        out[b.shape[0] + a.shape[0]] -= s * value


@compiled
def _tail(
    out: NDArray[np.complex128], sums: NDArray[np.complex128], n_top: NDArray[np.float64], d_top: NDArray[np.float64],
    b: NDArray[np.float64], a: NDArray[np.float64], scale: float, period: float, lowest: int, reach: float, jacobian: bool,
) -> None:  # fmt: skip
    """Add the aliases beyond the last, from the series of N / D in 1 / s; out: (points, width), sums: (points, SERIES + 1)."""
    size = n_top.shape[1]
    up, down = np.zeros(size), np.zeros(size)
    for i in range(b.shape[0]):  # a polynomial of lower order starts lower in the series
        for j in range(size):
            up[j] += b[i] * n_top[i, j]
    for i in range(a.shape[0]):
        for j in range(size):
            down[j] += a[i] * d_top[i, j]
    if down[0] == 0.0:
        return
    radius = 0.0
    for j in range(1, size):
        radius = max(radius, 2.0 * abs(down[j] / down[0]) ** (1.0 / j))
    if radius > reach:
        return
    inverse, ratio, square = np.zeros(size), np.zeros(size), np.zeros(size)
    inverse[0] = 1.0 / down[0]
    for j in range(1, size):
        for i in range(1, j + 1):
            inverse[j] -= down[i] * inverse[j - i] / down[0]
    for j in range(size):
        for r in range(j + 1):
            ratio[j] += up[r] * inverse[j - r]
    for j in range(size):
        for r in range(j + 1):
            square[j] -= ratio[r] * inverse[j - r]
    weight = np.zeros(size)
    for j in range(size):
        weight[j] = (scale * period) ** (lowest + j) / scale
    for p in range(out.shape[0]):
        for j in range(size):
            out[p, 0] += ratio[j] * weight[j] * sums[p, j + 1]
        if jacobian:
            for i in range(b.shape[0]):
                for j in range(size):
                    for r in range(j + 1):
                        out[p, 1 + i] += n_top[i, r] * inverse[j - r] * weight[j] * sums[p, j + 1]
            for i in range(a.shape[0] - 1):
                for j in range(size):
                    for r in range(j + 1):
                        out[p, 1 + b.shape[0] + i] += d_top[i, r] * square[j - r] * weight[j] * sums[p, j + 1]
            for j in range(size):
                out[p, b.shape[0] + a.shape[0]] -= ratio[j] * weight[j] * sums[p, j] / period


@compiled
def _predict(
    b: NDArray[np.float64], a: NDArray[np.float64], delay: float, jacobian: bool, integrators: int, scale: float, period: float,
    omega: NDArray[np.float64], main: NDArray[np.complex128], fold: NDArray[np.complex128],
    index: NDArray[np.int64], conjugate: NDArray[np.bool_], kernel: NDArray[np.complex128],
    alias: NDArray[np.complex128], alias_factor: NDArray[np.complex128], alias_number: NDArray[np.float64],
    spread: NDArray[np.float64], tail: NDArray[np.float64],
    n_grid: NDArray[np.complex128], d_grid: NDArray[np.complex128], n_alias: NDArray[np.complex128], d_alias: NDArray[np.complex128],
    n_top: NDArray[np.float64], d_top: NDArray[np.float64],
) -> NDArray[np.complex128]:  # fmt: skip
    width = 1 + b.shape[0] + a.shape[0] if jacobian else 1
    size, nodes, numbers = omega.shape[0], spread.shape[1], alias_number.shape[0]
    rows = np.zeros((size, width), dtype=np.complex128)
    if nodes > 0:
        at_nodes = np.zeros((nodes, width), dtype=np.complex128)
        phase = np.exp(-2j * np.pi * alias_number * (delay / period))
        for n in range(nodes):
            for k in range(numbers):
                i = n * numbers + k
                _row(at_nodes[n], n_alias[i], d_alias[i], b, a, phase[k] * alias_factor[i], alias[i] * scale, jacobian)
        lowest = a.shape[0] - b.shape[0] + integrators + 1
        sums = tail_sums(TAIL_POINTS, delay / period, ALIASES, lowest - 1, SERIES + 1)
        beyond = np.zeros((TAIL_POINTS.shape[0], width), dtype=np.complex128)
        reach = TAIL_REACH * ALIASES * 2.0 * np.pi / (period * scale)
        _tail(beyond, sums, n_top, d_top, b, a, scale, period, lowest, reach, jacobian)
        at_nodes += (np.dot(tail, beyond.view(np.float64))).view(np.complex128)
        rows = (np.dot(spread, at_nodes.view(np.float64))).view(np.complex128)
        for g in range(size):
            for c in range(width):
                rows[g, c] *= fold[g]
    for g in range(size):
        _row(rows[g], n_grid[g], d_grid[g], b, a, main[g], 1j * omega[g], jacobian)
        turn = np.exp(-1j * omega[g] * delay)
        for c in range(width):
            rows[g, c] *= turn
    out = np.zeros((index.shape[0], width), dtype=np.complex128)
    for i in range(index.shape[0]):
        for j in range(index.shape[1]):
            row = rows[index[i, j]]
            if conjugate[i, j]:
                for c in range(width):
                    out[i, c] += kernel[i, j] * row[c].conjugate()
            else:
                for c in range(width):
                    out[i, c] += kernel[i, j] * row[c]
    return out
