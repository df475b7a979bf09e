"""From a point in parameter space to a Fit: coefficients, poles, zeros, and their uncertainty."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.covariance import covariance
from xy_sysid.fitting.damped import weighted
from xy_sysid.fitting.intervals import coefficient_estimates, gain_estimate, root_estimates, with_rate
from xy_sysid.fitting.problem import Point, Problem
from xy_sysid.fitting.result import Ended, Fit
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

CONSISTENT = 3.0  # standard deviations


def finish(task: Problem, at: Point, method: str, end: Ended, start: str, table: FloatArray | None = None) -> Fit:
    """The Fit at a point; table: ``damped.weighted`` there, if it is already available."""
    structure, plan, frf = task.structure, task.plan, task.frf
    table = weighted(task, at) if table is None else table
    error = table[-1].reshape(2, -1) / task.weight
    predicted = frf.response - (error[0] + 1j * error[1])
    value = 0.5 * float(table[-1] @ table[-1])
    if not np.all(np.isfinite(table)):
        return _failed(task, at, method, end, start)
    inner, expected, deviation = covariance(task, at, table)
    to_numerator, to_denominator = _to_coefficients(task, at)
    own = (at.b @ to_numerator)[::-1]
    numerator = np.concatenate((own, np.zeros(max(-structure.power, 0))))
    denominator = np.concatenate(((at.a @ to_denominator)[::-1], np.zeros(max(structure.power, 0))))
    if structure.domain == "z":
        denominator = denominator[: structure.free_order + 1]
        for _ in range(structure.integrators):
            denominator = np.convolve(denominator, [1.0, -1.0])
    tf = TransferFunction(
        numerator=numerator,
        denominator=denominator,
        delay=at.delay,
        sampling_time=None if structure.domain == "s" else plan.period,
        input_unit=frf.input_unit,
        output_unit=frf.output_unit,
    )
    map_all = _parameter_map(task, to_numerator, to_denominator)
    names = _names(task)
    reported = map_all @ inner @ map_all.T
    jacobian: FloatArray = np.asarray(table[:-1].T @ np.linalg.inv(map_all), dtype=np.float64)
    poles = at.denominator.roots(at.a)
    zeros = at.numerator.roots(at.b)
    rest = np.full(max(structure.power, 0), 0.0 if structure.domain == "s" else 1.0)
    still = np.zeros(max(-structure.power, 0))
    relative = float(np.sqrt(np.mean(np.abs((frf.response - predicted) / frf.response) ** 2)))
    values = np.concatenate((own, (at.a @ to_denominator)[:-1][::-1], [at.delay] if structure.free_delay else []))
    coefficients = coefficient_estimates(names, values, reported)
    gain = gain_estimate(task, at, inner)
    roots = *root_estimates(task, at, poles, inner, "pole"), *root_estimates(task, at, zeros, inner, "zero")
    warnings: list[str] = []
    if not np.isfinite(expected):
        consistent = None
    else:
        consistent = bool(value <= expected + CONSISTENT * deviation)
        if not consistent and end.converged:
            warnings.append(f"The cost {value:.4g} is above the {expected:.4g} that noise explains: the model misses something that the data show.")
    unstable = poles[(poles.real > 0) if structure.domain == "s" else (np.abs(poles) > 1)]
    if unstable.size:
        listed = ", ".join(f"{p:.4g}" for p in unstable * (plan.scale if structure.domain == "s" else 1.0))
        warnings.append(f"Unstable: poles at {listed}{' rad/s' if structure.domain == 's' else ''}.")
    if structure.free_delay and at.delay >= structure.delay_max * (1 - 1e-9):
        warnings.append(f"The delay is at its largest allowed value, {structure.delay_max:g} s; allow a larger one.")
    return Fit(
        tf=tf,
        structure=structure,
        method=method,
        frequency=frf.frequency,
        measured=frf.response,
        response=predicted,
        weight=task.weight,
        cost=value,
        expected_cost=expected,
        cost_deviation=deviation,
        consistent=consistent,
        relative_error=relative,
        parameters=names,
        covariance=reported,
        jacobian=jacobian,
        poles=np.concatenate((_ordered(poles) * plan.scale, rest)),
        zeros=np.concatenate((_ordered(zeros) * plan.scale, still)),
        intervals=with_rate((*coefficients, gain, *roots), frf.rate_error, structure),
        iterations=end.iterations,
        converged=end.converged,
        reason=end.reason,
        warnings=tuple(warnings),
        start=start,
    )


def _failed(task: Problem, at: Point, method: str, end: Ended, start: str) -> Fit:
    """A Fit without an estimate, because numbers were out of range; unknown values are NaN."""
    structure, frf, nan = task.structure, task.frf, float("nan")
    lines, names = np.full(len(frf), np.nan), _names(task)
    bottom = np.zeros(structure.free_order + max(structure.power, 0) + 1)
    bottom[0] = 1.0
    period = None if structure.domain == "s" else task.plan.period
    return Fit(
        tf=TransferFunction(
            numerator=np.full(structure.numerator_order + 1, np.nan),
            denominator=bottom,
            delay=at.delay,
            sampling_time=period,
            input_unit=frf.input_unit,
            output_unit=frf.output_unit,
        ),
        structure=structure,
        method=method,
        frequency=frf.frequency,
        measured=frf.response,
        response=lines.astype(np.complex128),
        weight=task.weight,
        cost=float("inf"),
        expected_cost=nan,
        cost_deviation=nan,
        consistent=None,
        relative_error=float("inf"),
        parameters=names,
        covariance=np.full((len(names), len(names)), np.nan),
        jacobian=np.full((2 * len(frf), len(names)), np.nan),
        poles=np.zeros(0, dtype=np.complex128),
        zeros=np.zeros(0, dtype=np.complex128),
        intervals=(),
        iterations=end.iterations,
        converged=False,
        reason=f"{end.reason} The numbers ran out of range.",
        warnings=("The fit failed: its numbers ran out of range. Scale the data or lower the orders.",),
        start=start,
    )


def _ordered(roots: ComplexArray) -> ComplexArray:
    return roots[np.lexsort((roots.imag, np.round(np.abs(roots), 12)))]


def _to_coefficients(task: Problem, at: Point) -> tuple[FloatArray, FloatArray]:
    """(m + 1, m + 1) and (n + 1, n + 1): row k is the contribution of parameter k to the coefficients of rising powers of s."""
    up, down = at.numerator.powers(), at.denominator.powers()
    lead = down[-1, -1] * at.a[-1]
    scale, free = task.plan.scale, float(task.structure.free_order)
    order = free + task.structure.power
    return up / lead * scale ** (order - np.arange(up.shape[1])), down / lead * scale ** (free - np.arange(down.shape[1]))


def _parameter_map(task: Problem, to_numerator: FloatArray, to_denominator: FloatArray) -> FloatArray:
    """(p, p): from changes of (b, a, delay) to changes of the reported parameters (falling powers)."""
    m, n = task.structure.numerator_order + 1, task.structure.free_order
    out = np.zeros((m + n + int(task.structure.free_delay),) * 2)
    out[:m, :m] = to_numerator.T[::-1]
    out[m : m + n, m : m + n] = to_denominator[:n, :n].T[::-1]
    if task.structure.free_delay:
        out[-1, -1] = 1.0
    return out


def _names(task: Problem) -> tuple[str, ...]:
    """numerator_k and denominator_k are the coefficients of s^k (z^k, in the z domain of the part without integrators)."""
    structure = task.structure
    shift, above = (max(structure.power, 0), max(-structure.power, 0)) if structure.domain == "s" else (0, 0)
    top = [f"numerator_{k + above}" for k in range(structure.numerator_order, -1, -1)]
    bottom = [f"denominator_{k + shift}" for k in range(structure.free_order - 1, -1, -1)]
    return tuple(top + bottom + (["delay"] if structure.free_delay else []))
