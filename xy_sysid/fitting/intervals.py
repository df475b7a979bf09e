"""95 % intervals by the delta method: coefficients, gain, poles, zeros, resonances and antiresonances."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import numpy as np

from xy_sysid.fitting.problem import Point, Problem
from xy_sysid.fitting.structure import Structure
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95, ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import over, position_of

BEYOND = 1e3  # standard error relative to the value above which an interval is unlimited
PAIRS = {"pole": "resonance", "zero": "antiresonance"}


def _estimate(name: str, value: float, variance: float, unit: str) -> Estimate:
    sigma = float(np.sqrt(variance)) if variance >= 0 else float("nan")
    if not sigma <= BEYOND * abs(value) and value != 0.0:
        sigma = float("inf")
    return Estimate(name=name, value=float(value), unit=unit, low=float(value) - Z95 * sigma, high=float(value) + Z95 * sigma)


def with_rate(items: Iterable[Estimate], error: float, structure: Structure) -> tuple[Estimate, ...]:
    """The intervals including the relative ``error`` of the sampling rate, with which every time and frequency scales.

    A model of s that is fitted to lines of a rate c times too high has b_k and a_k c^(n - k) times too large, n the order.
    """

    def widened(item: Estimate) -> Estimate:
        sigma = math.hypot(item.sigma, _power(item.name, structure) * error * item.value)
        return replace(item, low=item.value - Z95 * sigma, high=item.value + Z95 * sigma)

    return tuple(widened(item) for item in items) if error > 0.0 else tuple(items)


def _power(name: str, structure: Structure) -> int:
    """The power of the sampling rate with which an estimate scales."""
    kind, _, rest = name.partition("_")
    if kind == "delay" or (kind in PAIRS.values() and rest.endswith("frequency")):
        return 1
    if kind == "gain":
        return structure.power
    if structure.domain == "z" or kind in PAIRS.values():
        return 0
    return 1 if kind in PAIRS else structure.free_order + max(structure.power, 0) - int(rest)


def coefficient_estimates(names: tuple[str, ...], values: FloatArray, covariance: FloatArray) -> tuple[Estimate, ...]:
    """The reported parameters, in order."""
    return tuple(
        _estimate(name, float(value), float(variance), "s" if name == "delay" else "")
        for name, value, variance in zip(names, values, np.diag(covariance), strict=True)
    )


def gain_estimate(task: Problem, at: Point, inner: FloatArray) -> Estimate:
    """Gain of s^integrators times the position's response at s = 0: the static gain, or the velocity gain with one integrator."""
    structure, frf = task.structure, task.frf
    where = np.array([0.0 + 0.0j if structure.domain == "s" else 1.0 + 0.0j])
    up, down = at.numerator.values(where)[0].real, at.denominator.values(where)[0].real
    bottom = float(down @ at.a)
    value = float(up @ at.b) / bottom
    scale = task.plan.scale**structure.power if structure.domain == "s" else task.plan.period ** -float(structure.integrators)
    slope = np.zeros(inner.shape[0])
    slope[: at.b.size] = up / bottom
    slope[at.b.size : at.b.size + at.a.size - 1] = -value * down[:-1] / bottom
    per = ("", "/s", "/s^2")[structure.integrators]
    unit = over(f"{position_of(frf.output_unit)}{per}", frf.input_unit)
    return _estimate("gain", value * scale, float(slope @ inner @ slope) * scale**2, unit)


def root_estimates(task: Problem, at: Point, roots: ComplexArray, inner: FloatArray, name: Literal["pole", "zero"]) -> list[Estimate]:
    """Roots of sum_k c_k p_k, conjugates once: d root / d c_k = -p_k(root) / derivative(root).

    roots: of the denominator ("pole") or the numerator ("zero") at the point; inner: covariance of its parameters
    Gives <name>_i, or <name>_i.real and .imag, and frequency and damping of each oscillating pair.
    """
    part, coefficients, first = (at.denominator, at.a, at.b.size) if name == "pole" else (at.numerator, at.b, 0)  # first: index of c_0
    discrete = task.structure.domain == "z"
    scale, unit = (1.0, "") if discrete else (task.plan.scale, "rad/s")
    size = coefficients.size - int(name == "pole")
    lead = coefficients[-1] * part.powers()[-1, -1]
    values = part.values(roots)
    out: list[Estimate] = []
    chosen = [i for i in np.argsort(np.abs(roots)) if roots[i].imag >= 0]
    pairs = 0
    for number, i in enumerate(chosen, start=1):
        others = np.delete(roots, i)
        slope = np.zeros(inner.shape[0], dtype=np.complex128)
        slope[first : first + size] = -values[i, :size] / (lead * np.prod(roots[i] - others))
        root, change = roots[i] * scale, slope * scale
        label = f"{name}_{number}"
        if root.imag == 0:
            out.append(_estimate(label, root.real, _variance(change.real, inner), unit))
            continue
        out.append(_estimate(f"{label}.real", root.real, _variance(change.real, inner), unit))
        out.append(_estimate(f"{label}.imag", root.imag, _variance(change.imag, inner), unit))
        if discrete:
            root, change = np.log(root) / task.plan.period, change / root / task.plan.period
        size_of = abs(root)
        turn = np.real(np.conj(root) * change) / size_of
        damping = -change.real / size_of + root.real * turn / size_of**2
        pairs += 1
        pair = f"{PAIRS[name]}_{pairs}"
        out.append(_estimate(f"{pair}.frequency", size_of / (2 * np.pi), _variance(turn, inner) / (2 * np.pi) ** 2, "Hz"))
        out.append(_estimate(f"{pair}.damping", -root.real / size_of, _variance(damping, inner), ""))
    return out


def _variance(slope: FloatArray, inner: FloatArray) -> float:
    return float(slope @ inner @ slope)
