"""kS, kV, kA, kG, kCos: the feedforward gains of drives and libraries, with intervals.

    voltage = kS sign(v) + kV v + kA a + kG + kCos cos(angle - zero)

Names as in WPILib's feedforward classes (SimpleMotorFeedforward, ElevatorFeedforward, ArmFeedforward).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.laws import ask, asks, driving_factor, force, friction, of_category
from xy_sysid.control_design.path import SampledPath
from xy_sysid.control_design.uncertain import Derived, derive, is_determined, is_known_angle
from xy_sysid.samples.block import FloatArray

USUAL_SPEED = 1.0  # V of the steady state at whose speed kS is taken
ARM, ANGLE = "kCos", "zero"  # names of the gain of an arm, and of the angle at which it is level


@dataclass(frozen=True, slots=True)
class Gains:
    """The gains by name, in the order in which they are shown."""

    items: tuple[Derived, ...]

    def __getitem__(self, name: str) -> Derived:
        return next(item for item in self.items if item.name == name)

    def value(self, name: str) -> float:
        """The value of a gain; 0 if the axis does not have it, or if it is in ``unsure``."""
        return next((item.value for item in self.items if item.name == name and name not in self.unsure), 0.0)

    @property
    def unsure(self) -> tuple[str, ...]:
        """Names of the gains that the data do not determine, with kCos if its angle is not determined. The angle itself is never one of them."""
        lost = any(item.name == ANGLE and not is_known_angle(item.low, item.high) for item in self.items)
        sure = {item.name: is_determined(item.value, item.low, item.high) and not (lost and item.name == ARM) for item in self.items}
        return tuple(name for name, is_sure in sure.items() if name != ANGLE and not is_sure)

    @property
    def doubt(self) -> str:
        """Names the exported numbers that are 0 because the data do not determine them; empty if none is."""
        return f"0 stands for {', '.join(self.unsure)}, which the data do not determine" if self.unsure else ""


def gains(model: PhysicalModel) -> Gains:
    """kS, kV, kA, and kG, kCos and values by direction if the model has them."""
    usual = abs(USUAL_SPEED * model.model.gain)
    way = math.copysign(1.0, model.model.gain)

    def rubs(of: AxisModel, direction: float) -> float:
        return friction(of, direction * usual, direction) / driving_factor(of)

    def starts(of: AxisModel) -> float:
        return friction(of, 0.0, 1.0) / driving_factor(of)

    def drags(of: AxisModel, speed: float) -> float:
        return (1.0 / of.gain + speed * force(of, speed, 0.0, of_speed=True)) / driving_factor(of)

    found = [
        derive(model, "kS", "V", "dry friction while sliding, mean of both directions", lambda of: way * 0.5 * (rubs(of, 1.0) + rubs(of, -1.0))),
        derive(model, "kV", "V/(m/s)", "holds a speed", lambda of: 1.0 / (of.gain * driving_factor(of))),
        derive(model, "kA", "V/(m/s2)", "accelerates the mass", lambda of: 1.0 / (of.gain * of.pole * driving_factor(of))),
    ]
    centre = model.model
    if abs(rubs(centre, 1.0) - rubs(centre, -1.0)) > 1e-9 * (rubs(centre, 1.0) + 1e-12):
        found.append(derive(model, "kS forth", "V", "dry friction while sliding forth", lambda of: way * rubs(of, 1.0)))
        found.append(derive(model, "kS back", "V", "dry friction while sliding back", lambda of: way * rubs(of, -1.0)))
    if abs(starts(centre) - rubs(centre, 1.0)) > 1e-6 * (rubs(centre, 1.0) + 1e-12):
        found.append(derive(model, "breakaway", "V", "dry friction that is overcome from rest", lambda of: way * starts(of)))
    sides = [force(centre, side, 0.0, of_speed=True) for side in (1.0, -1.0)]
    if abs(sides[0] + sides[1]) > 1e-12:
        found.append(derive(model, "kV forth", "V/(m/s)", "holds a speed forth", lambda of: drags(of, 1.0)))
        found.append(derive(model, "kV back", "V/(m/s)", "holds a speed back", lambda of: drags(of, -1.0)))
    if any(not asks(effect) - {"gain", "pole"} for effect, _ in of_category(centre, "force")):
        found.append(derive(model, "kG", "V", "holds the constant load", lambda of: force(of, 0.0, 0.0, of_speed=False, by_place=False)))
    if any(effect.angular for effect, _ in of_category(centre, "force")):
        found.append(derive(model, ARM, "V", "holds the arm level", lambda of: math.hypot(*_turning(of))))
        found.append(derive(model, ANGLE, "rad", "angle at which the arm is level", lambda of: math.atan2(*_turning(of)), True))
    return Gains(tuple(found))


def _turning(model: AxisModel) -> tuple[float, float]:
    """Amplitudes of sine and cosine of the forces by angle, V: their values at a quarter turn and at 0."""

    def at(x: float) -> float:
        turned = [item for item in of_category(model, "force") if item[0].angular]
        return sum(ask(effect, values, "force", {"x": x, "gain": model.gain}) for effect, values in turned)

    return at(0.5 * math.pi), at(0.0)


def simple_feedforward(found: Gains, path: SampledPath, friction_too: bool = True) -> FloatArray:
    """(n,) voltage along a path, V: kS sign(v) + kV v + kA a (and kG, kCos), as drives calculate it, without preview."""
    return np.asarray(
        (found.value("kS") * np.sign(path.speed) if friction_too else 0.0)
        + found.value("kV") * path.speed
        + found.value("kA") * path.acceleration
        + found.value("kG")
        + found.value("kCos") * np.cos(path.position - found.value(ANGLE))
    )
