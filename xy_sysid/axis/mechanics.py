"""Mass or inertia, damping and friction in SI, where the input is a force, a torque, or a current with a known torque constant.

The model tau v' + v = gain (u - friction) is inertia v' + damping v = torque - friction, with torque = factor u, damping = factor / gain and
inertia = factor / (gain pole). With a gear each number is given twice: at the joint or table, and at the motor.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from xy_sysid.effects import SIMPLEST_FRICTION
from xy_sysid.errors import BadInput
from xy_sysid.units import SCALES, Units

FRICTION = f"{SIMPLEST_FRICTION.name}.{SIMPLEST_FRICTION.names[0]}"
ROBOTS = {"inertia": "armature", "damping": "damping", FRICTION: "frictionloss", "friction": "frictionloss"}  # MuJoCo, URDF


class Figure(Protocol):
    """A parameter with its interval."""

    @property
    def name(self) -> str:
        """The name of the parameter."""

    @property
    def value(self) -> float:
        """The value in ``unit``."""

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval."""

    @property
    def high(self) -> float:
        """Upper end of the 95 % interval."""

    @property
    def unit(self) -> str:
        """Unit of value and interval."""


@dataclass(frozen=True, slots=True)
class Transmission:
    """kt: N m/A at the motor, None if the input is a torque or force; ratio: turns of the motor per turn of the joint, or rad per metre."""

    kt: float | None = None
    ratio: float | None = None


@dataclass(frozen=True, slots=True)
class Mechanical:
    """One number in SI: at the joint or table, at the motor (None without a gear), and its name in MuJoCo and URDF (empty without one)."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    at_motor: float | None
    motor_unit: str
    robot_name: str = ""


def drive_from(kt: float | None, gear: str, units: Units) -> Transmission:
    """The transmission from --kt and --gear; gear: motor turns per output turn (50), or travel per motor turn with unit (5mm). Raises BadInput."""
    if kt is not None and units.input != "A":
        raise BadInput("--kt", f"{kt:g} N m/A", f"an input in A, and this one is in {units.input}", "Say --unit input=A if it is a current.")
    if kt is not None and not 0.0 < kt < 1e6:
        raise BadInput("--kt", kt, "more than 0 N m/A", "Give the torque constant of the motor's data sheet.")
    if not gear:
        return Transmission(kt)
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-zA-Zµμ]*)\s*", gear)
    try:
        value = float(found[1]) if found else 0.0
    except ValueError:
        value = 0.0
    unit = found[2] if found else ""
    length = SCALES.get(unit, ("", 0.0))
    linear = units.output == "m"
    if not 0.0 < value < 1e9 or (unit and length[0] != "m") or linear != bool(unit):
        allowed = "the way of one turn with its unit, such as 5mm" if linear else "turns of the motor for one of the output, such as 50"
        raise BadInput("--gear", gear, allowed, "Change it.")
    return Transmission(kt, math.tau / (value * length[1]) if unit else value)


def mechanics(figures: Iterable[Figure], units: Units, drive: Transmission) -> tuple[Mechanical, ...]:
    """Gain, pole (or time constant) and friction in SI; empty unless the input is a force, a torque or a current with a known constant.

    figures: gain, pole or time_constant, and parameters in the unit of the input. Intervals assume independent gain and pole, which makes
    those of the inertia too wide rather than too narrow.
    """
    linear, factor = units.output == "m", _factor(units, drive)
    if factor is None or units.output not in ("m", "rad"):
        return ()
    known = {item.name: item for item in figures}
    gain = known.get("gain")
    slow = known.get("pole") or known.get("pole_1") or known.get("time_constant")
    force, mass = ("N", "kg") if linear else ("N m", "kg m^2")
    found: list[Mechanical] = []
    if gain is not None and gain.value != 0.0:
        if slow is not None and slow.value != 0.0:
            size = (1.0 / abs(gain.value)) * (slow.value if slow.name == "time_constant" else 1.0 / abs(slow.value))
            wide = math.hypot(_spread(gain), _spread(slow))
            found.append(_both("inertia" if not linear else "mass", factor * size, wide, mass, drive, 2))
        found.append(_both("damping", factor / abs(gain.value), _spread(gain), f"{force} s/{'m' if linear else 'rad'}", drive, 2))
    for item in known.values():
        if item.unit == units.input:
            low, high = sorted((factor * item.low, factor * item.high))
            found.append(at_both(item.name, (factor * item.value, low, high), force, drive, 1))
    return tuple(found)


def robot_parameters(figures: Iterable[Figure], units: Units, inertia: float, gear: str = "") -> tuple[Mechanical, ...]:
    """A servo in the names and units of MuJoCo (position actuator and joint) and URDF (dynamics, limit), at the joint and at the motor.

    figures: stiffness, damping, friction and limit over the inertia; inertia: of the joint with its load, kg m^2, or mass, kg
    gear:    as for ``drive_from``. Raises BadInput for one that cannot be, and for angles in counts.
    """
    linear, drive = units.output == "m", drive_from(None, gear, units)
    if not inertia > 0.0:
        raise BadInput("inertia", f"{inertia:g} kg m^2", "more than 0", "Give that of the joint with its load.")
    if not linear and units.output != "rad":
        raise BadInput("inertia", f"of a joint in {units.output}", "one in rad or m", "Convert target and position, with --scale and --unit.")
    force, mass, per = ("N", "kg", "m") if linear else ("N m", "kg m^2", "rad")
    names = {
        "stiffness": ("kp", f"{force}/{per}", 2),
        "damping": ("damping", f"{force} s/{per}", 2),
        "friction": ("frictionloss", force, 1),
        "limit": ("forcerange", force, 1),
    }
    rows = [
        at_both(name, (inertia * item.value, inertia * item.low, inertia * item.high), unit, drive, power)
        for item in figures
        if item.name in names
        for name, unit, power in (names[item.name],)
    ]
    return (at_both("armature", (inertia, inertia, inertia), mass, drive, 2), *rows)


def _factor(units: Units, drive: Transmission) -> float | None:
    """Force or torque at the output per unit of the input; None if unknown."""
    ratio = drive.ratio or 1.0
    if units.input == "A":
        return None if drive.kt is None or (units.output == "m" and drive.ratio is None) else drive.kt * ratio
    if units.input == "N m":
        return None if units.output == "m" and drive.ratio is None else ratio
    return 1.0 if units.input == "N" and units.output == "m" else None


def _spread(item: Figure) -> float:
    """Half width of the interval relative to the value, on a log scale."""
    ends = [abs(end) for end in (item.low, item.high)]
    if item.low * item.high <= 0.0 or not all(map(math.isfinite, ends)):
        return math.inf
    return 0.5 * math.log(max(ends) / min(ends))


def _both(name: str, value: float, wide: float, unit: str, drive: Transmission, power: int) -> Mechanical:
    factor = math.exp(wide) if wide < 700.0 else math.inf
    return at_both(name, (value, value / factor, value * factor), unit, drive, power)


def at_both(name: str, figures: tuple[float, float, float], unit: str, drive: Transmission, power: int) -> Mechanical:
    """A number at the joint or table, its value at the motor being smaller by a power of the ratio: 1 for torques, 2 for inertia and damping.

    figures: value and both ends of its interval
    """
    value, low, high = figures
    at_motor = None if drive.ratio is None else value / drive.ratio**power
    turned = {"kg": "kg m^2", "N": "N m", "N s/m": "N m s/rad", "N/m": "N m/rad"}.get(unit, unit)
    return Mechanical(
        name=name,
        value=value,
        low=low,
        high=high,
        unit=unit,
        at_motor=at_motor,
        motor_unit=turned,
        robot_name=ROBOTS.get(name, "armature" if name == "mass" else ""),
    )
