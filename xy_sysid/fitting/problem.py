"""The lines to be fitted, their weights, and a point in the space of models."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting.basis import Basis, basis
from xy_sysid.fitting.plan import Plan, plan_for
from xy_sysid.fitting.prediction import Model, model_for, predict
from xy_sysid.fitting.structure import Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import derivative_of

SMALLEST, LARGEST = 1e-100, 1e100  # of |FRF|: squares of more or less leave the range of numbers
SMALLEST_SIGMA = 1e-13  # of |FRF|: below this the response is exact in double precision


@dataclass(frozen=True, slots=True)
class Problem:
    """frf: the trusted lines only; weight: (m,) of each line's error; sigma: (m,) or None if the response has none."""

    frf: FrequencyResponse
    structure: Structure
    plan: Plan
    weight: FloatArray
    sigma: FloatArray | None


@dataclass(frozen=True, slots=True)
class Point:
    """A model: N / D exp(-s delay), coefficients b and a (the last one of a is fixed) in their bases."""

    numerator: Basis
    denominator: Basis
    b: FloatArray
    a: FloatArray
    delay: float


def problem(frf: FrequencyResponse, structure: Structure) -> Problem:
    """Select the trusted lines and weigh them. Raises BadInput if they cannot determine the parameters."""
    structure = of_quantity(structure, frf)
    usable = frf.trusted & np.isfinite(frf.response) & (frf.frequency > 0) & (np.abs(frf.response) > 0)
    chosen = frf.select(usable)
    if 2 * len(chosen) <= structure.parameters:
        raise BadInput(
            "number of trusted lines",
            len(chosen),
            f"more than {structure.parameters // 2} for {structure.parameters} parameters",
            "Record longer, widen the band or lower the orders.",
        )
    magnitude = np.abs(chosen.response)
    if not (float(np.min(magnitude)) > SMALLEST and float(np.max(magnitude)) < LARGEST):
        raise BadInput("magnitude of the response", f"{np.min(magnitude):.3g} to {np.max(magnitude):.3g}", "1e-100 to 1e100", "Scale the data.")
    has_sigma = bool(np.all(np.isfinite(chosen.sigma)) and np.all(chosen.sigma >= 0))
    sigma = np.maximum(chosen.sigma, SMALLEST_SIGMA * magnitude) if has_sigma else None
    if structure.weighting == "sigma":
        if sigma is None:
            raise BadInput("sigma of the response", "not finite or negative", "finite, >= 0", "Use weighting 'relative' or average more windows.")
        weight = 1.0 / sigma
    elif structure.weighting == "relative":
        weight = 1.0 / magnitude
    else:
        weight = np.ones(len(chosen))
    if structure.domain == "z" and structure.delay != "free":
        samples = structure.delay * chosen.sampling_rate
        if abs(samples - round(samples)) > 1e-6:
            raise BadInput("delay of a discrete model", f"{samples:.6g} samples", "a whole number of samples", "Round it, or use domain 's'.")
    return Problem(frf=chosen, structure=structure, plan=plan_for(chosen, structure), weight=weight, sigma=sigma)


def of_quantity(structure: Structure, frf: FrequencyResponse) -> Structure:
    """The same family for a response of position, velocity or acceleration; without hold for acceleration, which would jump with a held input."""
    derivative = derivative_of(frf.output_unit) if structure.domain == "s" else 0
    if derivative == structure.derivative:
        return structure
    return replace(structure, derivative=derivative, hold="none" if derivative == 2 else structure.hold)


def model(task: Problem, at: Point) -> Model:
    """The point's bases, evaluated on the problem's grid."""
    return model_for(task.plan, task.structure.power, at.numerator, at.denominator)


def response(task: Problem, at: Point) -> ComplexArray:
    """(m,) prediction on the lines."""
    return predict(model(task, at), at.b, at.a, at.delay)


def cost(task: Problem, predicted: ComplexArray) -> float:
    """Half the sum of squared weighted errors."""
    error = task.weight * (predicted - task.frf.response)
    return 0.5 * float(np.vdot(error, error).real)


def rational(task: Problem, at: Point) -> tuple[ComplexArray, ComplexArray]:
    """(N, D) on the lines."""
    line = task.plan.line
    return at.numerator.values(line) @ at.b, at.denominator.values(line) @ at.a


def rebased(task: Problem, at: Point) -> Point:
    """The same model in bases that are orthonormal under the weight of its own errors."""
    n_values, d_values = rational(task, at)
    factor = task.weight * np.abs(task.plan.line_factor / d_values)
    return in_bases(task, n_values, d_values, at.delay, factor)


def in_bases(task: Problem, n_values: ComplexArray, d_values: ComplexArray, delay: float, factor: FloatArray) -> Point:
    """The model with these values of N and D on the lines; factor: (m,) weight of N in each line's error."""
    structure, line = task.structure, task.plan.line
    own = factor * np.abs(n_values / d_values)
    own = np.maximum(own, 1e-9 * float(np.max(own)))
    numerator, denominator = basis(line, factor, structure.numerator_order), basis(line, own, structure.free_order)
    b, a = _project(numerator.values(line), n_values, factor), _project(denominator.values(line), d_values, own)
    if a[-1] == 0.0:
        a[-1] = 1e-300
    return Point(numerator=numerator, denominator=denominator, b=b / a[-1], a=a / a[-1], delay=delay)


def _project(values: ComplexArray, target: ComplexArray, weight: FloatArray) -> FloatArray:
    """Coefficients of a polynomial in a basis that is orthonormal under the weight, with one correction of rounding errors."""
    rows = np.ascontiguousarray((values * weight[:, None]).T)
    goal = target * weight
    first: FloatArray = np.asarray((rows.conj() @ goal).real)
    return np.asarray(first + (rows.conj() @ (goal - first @ rows)).real)


def from_transfer_function(task: Problem, tf: TransferFunction) -> Point | None:
    """The point of a given model; None if its domain, orders or integrators differ from the structure."""
    structure = task.structure
    numerator, denominator = tf.numerator[np.argmax(tf.numerator != 0) :], tf.denominator[np.argmax(tf.denominator != 0) :]
    if (tf.sampling_time is None) != (structure.domain == "s") or not numerator.size or numerator.size > structure.numerator_order + 1:
        return None
    if structure.power < 0:
        numerator = np.trim_zeros(numerator, "b")
    if denominator.size != structure.free_order + max(structure.power, 0) + 1:
        return None
    for _ in range(max(structure.power, 0)):
        if structure.domain == "s":
            if abs(denominator[-1]) > 1e-9 * float(np.max(np.abs(denominator))):
                return None
            denominator = denominator[:-1]
        else:
            denominator, rest = np.polydiv(denominator, np.array([1.0, -1.0]))
            if float(np.max(np.abs(rest))) > 1e-6 * float(np.max(np.abs(tf.denominator))):
                return None
    line, power = task.plan.line, task.plan.scale
    up = numerator * power ** (np.arange(numerator.size)[::-1] - float(structure.free_order + structure.power))
    down = denominator * power ** (np.arange(denominator.size)[::-1] - float(structure.free_order))
    n_values: ComplexArray = np.asarray(np.polyval(up, line), dtype=np.complex128)
    d_values: ComplexArray = np.asarray(np.polyval(down, line), dtype=np.complex128)
    if not (bool(np.all(np.isfinite(n_values / d_values))) and bool(np.any(n_values != 0))):
        return None
    delay = tf.delay if structure.delay == "free" else float(structure.delay)
    return in_bases(task, n_values, d_values, min(delay, structure.delay_max), task.weight * np.abs(task.plan.line_factor / d_values))


def moved(at: Point, b: FloatArray, a: FloatArray, delay: float) -> Point:
    """Other parameters in the same bases."""
    return replace(at, b=b, a=a, delay=delay)
