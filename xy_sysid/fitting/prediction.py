"""The prediction on the lines and its analytic Jacobian, compiled.

Parameters: numerator b (m + 1) and denominator a (n + 1, the last one fixed) in an Arnoldi basis, and the delay.
    d(N / D) / db_i = p_i / D,   d(N / D) / da_i = -(N / D) p_i / D,   d / d(delay) = -s
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from xy_sysid.fitting.basis import Basis
from xy_sysid.fitting.plan import Plan
from xy_sysid.jit import compiled
from xy_sysid.linear.hold import ALIASES, SERIES, TAIL_POINTS, tail_sums
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

LONG = 8  # mean number of lines of a run from which a loop over each run is faster than one that looks up every row
TAIL_REACH = 0.5  # the series in 1 / s is used if every pole is within this fraction of the last alias


@dataclass(frozen=True, slots=True)
class Model:
    """A plan with two bases and their values on it, for the evaluation of parameters.

    numerator, denominator: the bases; *_top: (order + 1, SERIES) their highest powers
    *_grid, *_alias: (2, order + 1, points) real and imaginary parts of their values
    """

    plan: Plan
    integrators: int
    numerator: Basis
    denominator: Basis
    numerator_grid: FloatArray
    denominator_grid: FloatArray
    numerator_alias: FloatArray
    denominator_alias: FloatArray
    numerator_top: FloatArray
    denominator_top: FloatArray


def model_for(plan: Plan, integrators: int, numerator: Basis, denominator: Basis) -> Model:
    """Evaluate two bases wherever the plan needs them."""
    return Model(
        plan=plan,
        integrators=integrators,
        numerator=numerator,
        denominator=denominator,
        numerator_grid=numerator.parts(plan.grid),
        denominator_grid=denominator.parts(plan.grid),
        numerator_alias=numerator.parts(plan.alias),
        denominator_alias=denominator.parts(plan.alias),
        numerator_top=_top(numerator),
        denominator_top=_top(denominator),
    )


def _top(part: Basis) -> FloatArray:
    """(order + 1, SERIES): coefficients of x^order, x^(order - 1), ... of each polynomial."""
    table = part.powers()[:, ::-1]
    out = np.zeros((table.shape[0], SERIES))
    width = min(SERIES, table.shape[1])
    out[:, :width] = table[:, :width]
    return out


def predict(model: Model, b: FloatArray, a: FloatArray, delay: float) -> ComplexArray:
    """(lines,) predicted response."""
    parts = _lines(model, b, a, delay, False)
    return np.asarray(parts[0, 0] + 1j * parts[0, 1])


def unblurred(model: Model, b: FloatArray, a: FloatArray, delay: float) -> ComplexArray:
    """(g,) predicted response on the grid, before smoothing by the window."""
    plan = model.plan
    rows, runs = np.arange(plan.omega.size)[None, :], np.array([0, plan.omega.size])
    bare = replace(model, plan=replace(plan, index=rows, runs=runs, kernel=np.ones(1), after=np.ones(plan.omega.size, dtype=np.complex128)))
    return predict(bare, b, a, delay)


def table(model: Model, b: FloatArray, a: FloatArray, delay: float, weight: FloatArray, measured: ComplexArray) -> FloatArray:
    """(p + 1, 2 lines), real parts before imaginary ones: rows of weighted derivatives to b, a[:-1] and the delay; weighted error.

    The error, in the last row, is measured - predicted.
    """
    return _table(_lines(model, b, a, delay, True), weight, measured)


def _lines(model: Model, b: FloatArray, a: FloatArray, delay: float, jacobian: bool) -> FloatArray:
    """(1, or 1 + parameters, 2, lines): prediction, then its derivatives to b, a[:-1] and the delay; real and imaginary parts."""
    plan = model.plan
    return _predict(
        b, a, delay, jacobian, model.integrators, plan.scale, plan.period, plan.omega, plan.main, plan.fold,
        plan.index, plan.runs, plan.kernel, plan.after, plan.alias_omega, plan.alias_factor, plan.alias_number, plan.spread, plan.tail,
        model.numerator_grid, model.denominator_grid, model.numerator_alias, model.denominator_alias,
        model.numerator_top, model.denominator_top,
    )  # fmt: skip


@compiled
def _fractions(
    out: NDArray[np.float64], n_values: NDArray[np.float64], d_values: NDArray[np.float64], b: NDArray[np.float64],
    a: NDArray[np.float64], factor: NDArray[np.float64], omega: NDArray[np.float64],
) -> None:  # fmt: skip
    """Add factor * (N / D, its derivatives to b, a[:-1] and, with s = j omega, the delay) at each point.

    out: (width, 2, points), values: (2, order + 1, points), factor: (2, points). Inner loops are over points, for vectorisation.
    """
    size = omega.shape[0]
    top, bottom, work = np.zeros((2, size)), np.zeros((2, size)), np.empty((6, size))
    for part in range(2):
        for i in range(b.shape[0]):
            for g in range(size):
                top[part, g] += b[i] * n_values[part, i, g]
        for i in range(a.shape[0]):
            for g in range(size):
                bottom[part, g] += a[i] * d_values[part, i, g]
    for g in range(size):
        square = max(bottom[0, g] * bottom[0, g] + bottom[1, g] * bottom[1, g], 1e-300)
        up, down = bottom[0, g] / square, -bottom[1, g] / square  # 1 / D
        real = factor[0, g] * up - factor[1, g] * down
        imag = factor[0, g] * down + factor[1, g] * up
        work[0, g], work[1, g] = real, imag
        value_real = top[0, g] * real - top[1, g] * imag
        value_imag = top[0, g] * imag + top[1, g] * real
        work[2, g], work[3, g] = value_real, value_imag
        work[4, g] = -(value_real * up - value_imag * down)
        work[5, g] = -(value_real * down + value_imag * up)
    for g in range(size):
        out[0, 0, g] += work[2, g]
        out[0, 1, g] += work[3, g]
    if out.shape[0] == 1:
        return
    last = b.shape[0] + a.shape[0]
    for i in range(b.shape[0]):
        for g in range(size):
            out[1 + i, 0, g] += n_values[0, i, g] * work[0, g] - n_values[1, i, g] * work[1, g]
            out[1 + i, 1, g] += n_values[0, i, g] * work[1, g] + n_values[1, i, g] * work[0, g]
    for i in range(a.shape[0] - 1):
        c = 1 + b.shape[0] + i
        for g in range(size):
            out[c, 0, g] += d_values[0, i, g] * work[4, g] - d_values[1, i, g] * work[5, g]
            out[c, 1, g] += d_values[0, i, g] * work[5, g] + d_values[1, i, g] * work[4, g]
    for g in range(size):
        out[last, 0, g] += omega[g] * work[3, g]
        out[last, 1, g] -= omega[g] * work[2, g]


@compiled
def _tail(
    out: NDArray[np.float64], sums: NDArray[np.complex128], n_top: NDArray[np.float64], d_top: NDArray[np.float64],
    b: NDArray[np.float64], a: NDArray[np.float64], scale: float, period: float, lowest: int, reach: float, jacobian: bool,
) -> None:  # fmt: skip
    """Add the aliases beyond the last, from the series of N / D in 1 / s; out: (width, 2, points), sums: (points, SERIES + 1)."""
    size = n_top.shape[1]
    up, down = np.zeros(size), np.zeros(size)
    for i in range(b.shape[0]):  # a polynomial of lower order starts later in the series
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
    series = np.zeros((out.shape[0], size))  # of each column, in falling powers of s
    series[0] = ratio
    if jacobian:
        for j in range(size):
            for r in range(j + 1):
                for i in range(b.shape[0]):
                    series[1 + i, j] += n_top[i, r] * inverse[j - r]
                for i in range(a.shape[0] - 1):
                    series[1 + b.shape[0] + i, j] += d_top[i, r] * square[j - r]
    for p in range(out.shape[2]):
        for j in range(size):
            for c in range(out.shape[0]):
                term = series[c, j] * weight[j] * sums[p, j + 1]
                out[c, 0, p] += term.real
                out[c, 1, p] += term.imag
            if jacobian:
                slope = ratio[j] * weight[j] * sums[p, j] / period
                out[b.shape[0] + a.shape[0], 0, p] -= slope.real
                out[b.shape[0] + a.shape[0], 1, p] -= slope.imag


@compiled
def _smooth(
    out: NDArray[np.float64], values: NDArray[np.float64], index: NDArray[np.int64], runs: NDArray[np.int64], kernel: NDArray[np.float64]
) -> None:
    """Add to each line the weighted values on its rows of the grid: run by run, in loops that the compiler can vectorise, if the runs are long."""
    if runs.shape[0] > out.shape[0] // LONG:
        for j in range(kernel.shape[0]):
            weight = kernel[j]
            for i in range(out.shape[0]):
                out[i] += weight * values[index[j, i]]
        return
    for r in range(runs.shape[0] - 1):
        first, size = runs[r], runs[r + 1] - runs[r]
        to = out[first : first + size]
        for j in range(kernel.shape[0]):
            weight, row = kernel[j], index[j, first]
            own = values[row : row + size]
            for i in range(size):
                to[i] += weight * own[i]


@compiled
def _predict(
    b: NDArray[np.float64], a: NDArray[np.float64], delay: float, jacobian: bool, integrators: int, scale: float, period: float,
    omega: NDArray[np.float64], main: NDArray[np.complex128], fold: NDArray[np.complex128],
    index: NDArray[np.int64], runs: NDArray[np.int64], kernel: NDArray[np.float64], after: NDArray[np.complex128],
    alias_omega: NDArray[np.float64], alias_factor: NDArray[np.complex128], alias_number: NDArray[np.float64],
    spread: NDArray[np.float64], tail: NDArray[np.float64],
    n_grid: NDArray[np.float64], d_grid: NDArray[np.float64], n_alias: NDArray[np.float64], d_alias: NDArray[np.float64],
    n_top: NDArray[np.float64], d_top: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    width = 1 + b.shape[0] + a.shape[0] if jacobian else 1
    size, nodes, numbers, lines = omega.shape[0], spread.shape[0], alias_number.shape[0], index.shape[1]
    turn = np.empty(size, dtype=np.complex128)
    for g in range(size):
        turn[g] = complex(np.cos(omega[g] * delay), -np.sin(omega[g] * delay))
    rows = np.zeros((width, 2, size))
    factor = np.empty((2, size))
    if nodes > 0:
        terms, at_nodes = np.zeros((width, 2, alias_omega.shape[0])), np.zeros((2 * width, nodes))
        phase = np.exp(-2j * np.pi * alias_number * (delay / period))
        alias_parts = np.empty((2, alias_omega.shape[0]))
        for n in range(nodes):
            for k in range(numbers):
                value = phase[k] * alias_factor[n * numbers + k]
                alias_parts[0, n * numbers + k], alias_parts[1, n * numbers + k] = value.real, value.imag
        _fractions(terms, n_alias, d_alias, b, a, alias_parts, alias_omega)
        lowest = a.shape[0] - b.shape[0] + integrators + 1
        sums = tail_sums(TAIL_POINTS, delay / period, ALIASES, lowest - 1, SERIES + 1)
        beyond = np.zeros((width, 2, TAIL_POINTS.shape[0]))
        reach = TAIL_REACH * ALIASES * 2.0 * np.pi / (period * scale)
        _tail(beyond, sums, n_top, d_top, b, a, scale, period, lowest, reach, jacobian)
        at_nodes += np.dot(beyond.reshape(2 * width, TAIL_POINTS.shape[0]), tail)
        for c in range(width):
            for part in range(2):
                for n in range(nodes):
                    for k in range(numbers):
                        at_nodes[2 * c + part, n] += terms[c, part, n * numbers + k]
        rows = np.dot(at_nodes, spread).reshape(width, 2, size)
        for g in range(size):
            value = fold[g] * turn[g]
            factor[0, g], factor[1, g] = value.real, value.imag
        for c in range(width):
            for g in range(size):
                real, imag = rows[c, 0, g], rows[c, 1, g]
                rows[c, 0, g] = real * factor[0, g] - imag * factor[1, g]
                rows[c, 1, g] = real * factor[1, g] + imag * factor[0, g]
    for g in range(size):
        value = main[g] * turn[g]
        factor[0, g], factor[1, g] = value.real, value.imag
    _fractions(rows, n_grid, d_grid, b, a, factor, omega)
    out = np.zeros((width, 2, lines))
    for c in range(width):
        for part in range(2):
            _smooth(out[c, part], rows[c, part], index, runs, kernel)
        for i in range(lines):
            real, imag = out[c, 0, i], out[c, 1, i]
            out[c, 0, i] = real * after[i].real - imag * after[i].imag
            out[c, 1, i] = real * after[i].imag + imag * after[i].real
    return out


@compiled
def _table(lines: NDArray[np.float64], weight: NDArray[np.float64], measured: NDArray[np.complex128]) -> NDArray[np.float64]:
    last, size = lines.shape[0] - 1, lines.shape[2]
    out = np.empty((last + 1, 2 * size))
    for c in range(last):
        for i in range(size):
            out[c, i], out[c, size + i] = lines[1 + c, 0, i] * weight[i], lines[1 + c, 1, i] * weight[i]
    for i in range(size):
        out[last, i] = (measured[i].real - lines[0, 0, i]) * weight[i]
        out[last, size + i] = (measured[i].imag - lines[0, 1, i]) * weight[i]
    return out
