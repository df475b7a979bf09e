"""The true linear transfer function of an axis at small signal, and its stored energy.

The transfer function is derived from the mass, damping and stiffness matrices, not from the simulating kernel, so that
each checks the other.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sim.layout import BASE, BASE_SPEED, BRISTLE, MOTOR, MOTOR_SPEED, RATTLE, RATTLE_SPEED, TABLE, TABLE_SPEED, coupling, slot
from xy_sim.machine_file import Axis
from xy_sim.parts import (
    PARTS,
    base_loosening,
    base_resonance,
    cogging,
    contact,
    gain_drift,
    gravity,
    hardening_stiffness,
    loose_mode,
    return_spring,
    weak_modes,
)
from xy_sysid.samples.block import FloatArray

_Poly = FloatArray


def _determinant(matrix: list[list[_Poly]]) -> _Poly:
    """Determinant of a small matrix of polynomials in s (falling powers), by expansion along the first row."""
    if not matrix:
        return np.ones(1)
    total = np.zeros(1)
    for column, entry in enumerate(matrix[0]):
        minor = [row[:column] + row[column + 1 :] for row in matrix[1:]]
        term = np.polymul(entry, _determinant(minor))
        total = np.polyadd(total, term if column % 2 == 0 else -term)
    return np.asarray(total, dtype=np.float64)


def _trim(poly: _Poly, scale: float) -> _Poly:
    """The polynomial without leading coefficients that are zero within rounding; ``scale`` is a frequency of the system, rad/s."""
    size = np.abs(poly) * scale ** np.arange(poly.size - 1, -1, -1, dtype=np.float64)
    kept = poly.copy()
    kept[size < 1e-13 * size.max()] = 0.0
    return np.trim_zeros(kept, "f")


def _matrices(axis: Axis, time: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Mass, damping and stiffness matrices of the n coordinates that move at small signal, and the (6, n) map from them to all six.

    All six: motor and table relative to the base, base in space, rattling mass and the two weak modes relative to the base.
    """
    drive, parts = axis.drive, axis.parts
    drag = drive.force_per_volt * parts.get("viscous_friction", {}).get("coefficient", 0.0)
    mass, damping, stiff = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
    mass[0, 0] = drive.rotor_mass
    over = np.array([0.0, 1.0, 1.0, 0.0, 0.0, 0.0])  # the table's speed in space is its own plus the base's
    mass += drive.table_mass * np.outer(over, over)
    damping[0, 0] = (1.0 - drive.guide_share) * drive.drag + drag
    damping[1, 1] = drive.guide_share * drive.drag
    stiff[1, 1] = drive.force_per_volt * parts.get("hardening_stiffness", {}).get("linear", 0.0)
    if "gravity" in parts:
        stiff[1, 1] += drive.force_per_volt * gravity.stiffness(**parts["gravity"])
    if "return_spring" in parts:
        stiff[1, 1] += drive.force_per_volt * return_spring.slope(**parts["return_spring"])
    spring, dashpot = coupling(drive, parts)
    link = np.array([1.0, -1.0, 0.0, 0.0, 0.0, 0.0])
    stiff += spring * np.outer(link, link)
    damping += dashpot * np.outer(link, link)
    unit = np.eye(6)
    columns = [unit[0], unit[1]] if spring > 0.0 else [unit[0] + unit[1]]
    if "base_resonance" in parts:
        base = parts["base_resonance"]
        moving = base["mass"] + drive.table_mass
        mass[2, 2] += base["mass"]
        damping[2, 2] += base_resonance.dashpot(moving, base["frequency"], base["damping"])
        stiff[2, 2] += base_resonance.stiffness(moving, _base_frequency(axis, time))
        columns.append(unit[2])
    loose = parts.get("loose_mode")
    if loose is not None and loose["gap"] == 0.0:
        of_mass, rattle = unit[2] + unit[3], unit[1] - unit[3]
        mass += loose["mass"] * np.outer(of_mass, of_mass)
        stiff += loose_mode.stiffness(loose["mass"], loose["frequency"]) * np.outer(rattle, rattle)
        columns.append(unit[3])
    weak = parts.get("weak_modes", {})
    for place, which in ((4, ""), (5, "second_")):
        if weak.get(f"{which}mass", 0.0) > 0.0:
            of_mass, swing, small = unit[2] + unit[place], unit[1] - unit[place], weak[f"{which}mass"]
            mass += small * np.outer(of_mass, of_mass)
            stiff += weak_modes.force(small, weak[f"{which}frequency"], weak["damping"], 1.0, 0.0) * np.outer(swing, swing)
            damping += weak_modes.force(small, weak[f"{which}frequency"], weak["damping"], 0.0, 1.0) * np.outer(swing, swing)
            columns.append(unit[place])
    chosen = np.array(columns).T
    return chosen.T @ mass @ chosen, chosen.T @ damping @ chosen, chosen.T @ stiff @ chosen, chosen


def _base_frequency(axis: Axis, time: float) -> float:
    nominal = axis.parts["base_resonance"]["frequency"]
    loosening = axis.parts.get("base_loosening")
    if loosening is None:
        return nominal
    return base_loosening.frequency(nominal, loosening["drop"], loosening["start"], loosening["rate"], time)


def _transfer(axis: Axis, time: float) -> tuple[_Poly, _Poly]:
    """Numerator and denominator, position over voltage, denominator monic, falling powers of s."""
    mass, damping, stiff, chosen = _matrices(axis, time)
    n = mass.shape[0]
    matrix = [[np.array([mass[i, j], damping[i, j], stiff[i, j]]) for j in range(n)] for i in range(n)]
    seen = chosen[1 if axis.drive.encoder_on == "table" else 0]
    gain = axis.drive.force_per_volt
    if "gain_drift" in axis.parts:
        gain *= gain_drift.factor(axis.parts["gain_drift"]["rate"], axis.parts["gain_drift"]["limit"], time)
    numerator = np.zeros(1)
    for j in range(n):  # Cramer's rule: the force acts on the motor, which is coordinate 0
        minor = [[matrix[i][k] for k in range(n) if k != j] for i in range(1, n)]
        numerator = np.polyadd(numerator, (-1.0) ** j * seen[j] * gain * _determinant(minor))
    denominator = _determinant(matrix)
    lag = axis.parts.get("amplifier_lag", {}).get("lag", 0.0)
    if lag > 0.0:
        denominator = np.polymul(denominator, np.array([lag, 1.0]))
    scale = 2.0 * math.pi * 50.0
    numerator, denominator = _trim(numerator, scale), _trim(denominator, scale)
    return numerator / denominator[0], denominator / denominator[0]


def _pairs(roots: NDArray[np.complex128]) -> list[float]:
    """Natural frequencies of the complex pairs, rising, Hz."""
    return sorted(float(abs(root)) / (2.0 * math.pi) for root in roots if root.imag > 1e-6 * abs(root))


def fastest(axis: Axis) -> float:
    """Largest magnitude of the poles, rad/s, which the inner step must resolve."""
    return float(np.abs(np.roots(_transfer(axis, 0.0)[1])).max())


def linear(axis: Axis, time: float = 0.0) -> dict[str, Any]:
    """The true model that an identification should find, JSON-ready, SI.

    Without dry friction, dead zone, saturation and effects that repeat along the travel; backlash counts as closed, and drifts
    are taken at ``time``, s. velocity_gain is None if a spring holds the axis. pole is the real pole nearest to the drive's.
    """
    numerator, denominator = _transfer(axis, time)
    zeros, poles = np.roots(numerator).astype(np.complex128), np.roots(denominator).astype(np.complex128)
    integrates = denominator[-1] == 0.0
    real = [-float(root.real) for root in poles if abs(root.imag) <= 1e-9 * abs(root) and abs(root) > 1e-9]
    real.sort(key=lambda pole: abs(pole - axis.drive.pole))
    antiresonances, resonances = _pairs(zeros), _pairs(poles)
    return {
        "axis": axis.name,
        "numerator": numerator.tolist(),
        "denominator": denominator.tolist(),
        "delay": axis.parts.get("time_delay", {}).get("delay", 0.0),
        "velocity_gain": float(numerator[-1] / denominator[-2]) if integrates else None,
        "pole": real[0] if real else None,
        "antiresonance_hz": antiresonances[0] if antiresonances else None,
        "resonance_hz": resonances[0] if resonances else None,
        "antiresonances_hz": antiresonances,
        "resonances_hz": resonances,
        "force_per_volt": axis.drive.force_per_volt,
        "count": axis.drive.count,
        "parts": [
            {
                "name": name,
                "group": PARTS[name].group,
                "parameters": {item.name: {"value": values[item.name], "unit": item.unit} for item in PARTS[name].parameters},
            }
            for name, values in axis.parts.items()
        ],
    }


def energy(p: FloatArray, y: FloatArray, time: float) -> float:
    """Energy stored in one axis at ``time`` (s), J. p: layout.numbers; y: state; the work of a constant load counts as potential."""

    def get(name: str) -> float:
        return float(p[slot(name)])

    volt, table, base = get("force_per_volt"), get("table_mass"), get("base_resonance.mass")
    coupled = get("coupled") != 0.0
    x, v = (y[TABLE], y[TABLE_SPEED]) if coupled else (y[MOTOR], y[MOTOR_SPEED])
    total = 0.5 * get("rotor_mass") * y[MOTOR_SPEED] ** 2 + 0.5 * table * (v + y[BASE_SPEED]) ** 2 + 0.5 * base * y[BASE_SPEED] ** 2
    if base > 0.0:
        frequency = base_loosening.frequency(
            get("base_resonance.frequency"), get("base_loosening.drop"), get("base_loosening.start"), get("base_loosening.rate"), time
        )
        total += 0.5 * base_resonance.stiffness(base + table, frequency) * y[BASE] ** 2
    if get("loose_mode.mass") > 0.0:
        mass = get("loose_mode.mass")
        total += 0.5 * mass * (y[RATTLE_SPEED] + y[BASE_SPEED]) ** 2
        total += contact.energy(x - y[RATTLE], 0.5 * get("loose_mode.gap"), loose_mode.stiffness(mass, get("loose_mode.frequency")))
    if coupled:
        total += contact.energy(y[MOTOR] - x, 0.5 * get("backlash.gap"), get("coupling_stiffness"))
    total += contact.energy(x, get("travel"), get("stop_stiffness"))
    total += volt * hardening_stiffness.energy(get("hardening_stiffness.cubic"), get("hardening_stiffness.linear"), x)
    total += volt * gravity.energy(get("gravity.amplitude"), get("gravity.phase"), x)
    total += volt * return_spring.energy(get("return_spring.stiffness"), get("return_spring.rest"), get("return_spring.softening"), x)
    total += volt * get("constant_load.load") * x
    total += volt * cogging.energy(get("cogging.amplitude"), get("cogging_wavenumber"), get("cogging.phase"), y[MOTOR])
    if get("presliding_hysteresis.coulomb") > 0.0:
        total += 0.5 * volt * get("presliding_hysteresis.coulomb") / get("presliding_hysteresis.length") * y[BRISTLE] ** 2
    return float(total)
