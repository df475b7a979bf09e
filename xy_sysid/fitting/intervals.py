"""95 % intervals by the delta method: coefficients, gain, poles, zeros, resonances and antiresonances."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting.basis import Basis
from xy_sysid.fitting.problem import Point, Problem
from xy_sysid.fitting.result import Estimate
from xy_sysid.frf import ComplexArray
from xy_sysid.stream import FloatArray

QUANTILE = 1.959963984540054  # 97.5 % of the normal distribution
PAIRS = {"pole": "resonance", "zero": "antiresonance"}


def _estimate(name: str, value: float, variance: float, unit: str) -> Estimate:
    sigma = float(np.sqrt(variance)) if variance >= 0 else float("nan")
    return Estimate(name, float(value), sigma, float(value) - QUANTILE * sigma, float(value) + QUANTILE * sigma, unit)


def coefficient_estimates(names: tuple[str, ...], values: FloatArray, covariance: FloatArray) -> tuple[Estimate, ...]:
    """The reported parameters, in their order."""
    return tuple(
        _estimate(name, float(value), float(variance), "s" if name == "delay" else "")
        for name, value, variance in zip(names, values, np.diag(covariance), strict=True)
    )


def gain_estimate(task: Problem, at: Point, inner: FloatArray) -> Estimate:
    """Of s^integrators H at s = 0: the static gain, with one integrator the velocity gain."""
    structure, frf = task.structure, task.frf
    where = np.array([0.0 + 0.0j if structure.domain == "s" else 1.0 + 0.0j])
    up, down = at.numerator.values(where)[0].real, at.denominator.values(where)[0].real
    bottom = float(down @ at.a)
    value = float(up @ at.b) / bottom
    scale = task.plan.scale**structure.integrators if structure.domain == "s" else task.plan.period ** -float(structure.integrators)
    slope = np.zeros(inner.shape[0])
    slope[: at.b.size] = up / bottom
    slope[at.b.size : at.b.size + at.a.size - 1] = -value * down[:-1] / bottom
    per = ("", "/s", "/s^2")[structure.integrators]
    return _estimate("gain", value * scale, float(slope @ inner @ slope) * scale**2, f"{frf.output_unit}{per}/{frf.input_unit}")


def root_estimates(
    task: Problem, roots: ComplexArray, part: Basis, coefficients: FloatArray, inner: FloatArray, first: int, name: str
) -> list[Estimate]:
    """Roots of sum_k c_k p_k, conjugates once: d root / d c_k = -p_k(root) / derivative(root).

    first: where c_0 stands among the parameters; name: "pole" or "zero".
    Gives <name>_i, or <name>_i.real and .imag, and frequency and damping of each oscillating pair.
    """
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
