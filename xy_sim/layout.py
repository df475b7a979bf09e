"""One axis as a vector of numbers: the index of each parameter and each state.

Parameters of absent parts are zero, so every combination of parts runs in the same compiled kernel.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from xy_sim.drive import Drive
from xy_sim.parts import PARTS, curve
from xy_sim.parts import screw_compliance as screw
from xy_sysid.samples.block import FloatArray

STATES = (
    *("motor", "motor_speed", "base", "base_speed", "work", "volts", "bristle", "heat", "table", "table_speed", "rattle", "rattle_speed"),
    *("cable", "weak", "weak_speed", "second_weak", "second_weak_speed"),
)
MOTOR, MOTOR_SPEED, BASE, BASE_SPEED, WORK, VOLTS, BRISTLE, HEAT, TABLE, TABLE_SPEED, RATTLE, RATTLE_SPEED = range(12)
CABLE, WEAK, WEAK_SPEED, SECOND_WEAK, SECOND_WEAK_SPEED = range(12, len(STATES))
_OWN = {"amplifier_lag": VOLTS, "presliding_hysteresis": BRISTLE, "thermal_viscosity": HEAT, "loose_mode": RATTLE_SPEED}
_OWN |= {"backlash": TABLE_SPEED, "screw_compliance": TABLE_SPEED}
_OWN |= {"cable_pull": CABLE, "weak_modes": SECOND_WEAK_SPEED}  # the last state that a part needs

_DRIVE = (
    *("force_per_volt", "drag", "guide_share", "rotor_mass", "table_mass", "travel", "stop_stiffness", "stop_damping", "encoder_on_table"),
    *("coupled", "coupling_stiffness", "coupling_dashpot", "lead_error_wavenumber", "cogging_wavenumber", "gain_wavenumber", "dry", "states"),
)
_CURVED = ("uneven_drag", "uneven_gain", "gain_wander", "friction_wander", "cable_pull", "uneven_lines")  # parts with a random curve
_NAMES = (
    *_DRIVE,
    *(f"{part.name}.{parameter.name}" for part in PARTS.values() for parameter in part.parameters),
    *(f"{name}.curve.{k}" for name in _CURVED for k in range(curve.KNOTS)),
)
_SLOTS = {name: place for place, name in enumerate(_NAMES)}


def slot(name: str) -> int:
    """Index of a number in ``numbers``: a constant of the drive, or ``part.parameter``; raises KeyError for another name."""
    return _SLOTS[name]


def numbers(drive: Drive, parts: Mapping[str, Mapping[str, float]]) -> FloatArray:
    """Every parameter of one axis, SI, in the kernel's order."""
    row = {f"{part}.{name}": value for part, values in parts.items() for name, value in values.items()}
    row |= {name: getattr(drive, name) for name in _DRIVE if hasattr(drive, name)}
    row["encoder_on_table"] = float(drive.encoder_on == "table")
    row["coupled"] = float("backlash" in parts or "screw_compliance" in parts)
    row["coupling_stiffness"], row["coupling_dashpot"] = coupling(drive, parts)
    for name, part in (("lead_error_wavenumber", "lead_error"), ("cogging_wavenumber", "cogging")):
        if part in parts:
            row[name] = 2.0 * math.pi * parts[part]["per_revolution"] / drive.lead
    if "position_dependent_gain" in parts:
        row["gain_wavenumber"] = 2.0 * math.pi / parts["position_dependent_gain"]["period"]
    dry = any(name in parts for name in ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "load_dependent_friction"))
    row["dry"] = float(dry and "presliding_hysteresis" not in parts)
    for name in _CURVED:
        if name in parts:
            row |= {f"{name}.curve.{k}": height for k, height in enumerate(curve.heights(int(parts[name]["seed"])).tolist())}
    row["states"] = 1.0 + max([WORK, *(last for part, last in _OWN.items() if part in parts)])
    return np.array([row.get(name, 0.0) for name in _NAMES], dtype=np.float64)


def coupling(drive: Drive, parts: Mapping[str, Mapping[str, float]]) -> tuple[float, float]:
    """Stiffness (N/m) and damping (N s/m) between motor and table; zeros if they are one body."""
    if "screw_compliance" in parts:
        values = parts["screw_compliance"]
        stiffness = screw.stiffness(values["frequency"], drive.table_mass)
        return stiffness, screw.dashpot(values["frequency"], values["damping"], drive.table_mass)
    if "backlash" in parts:
        return parts["backlash"]["stiffness"], 0.0
    return 0.0, 0.0
