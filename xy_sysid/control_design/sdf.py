"""A refined model as SDF (Gazebo, Drake): mass, damping, friction, spring and limits of one joint; everything else is named in a comment.

Source: SDFormat specification 1.9, ``joint/axis/dynamics``: damping, friction, spring_reference, spring_stiffness; ``joint/axis/limit``.
"""

from __future__ import annotations

import math

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.laws import along, asks, lost_in, one_joint
from xy_sysid.effects._contract import Effect

PLACES = 101  # positions at which a spring is tested for linearity
ANYWHERE = -1.0, 1.0  # m or rad, range for a spring if the travel is unknown
STRAIGHT = 1e-6  # of the largest force: largest deviation of a spring that counts as linear


def sdf(model: AxisModel, travel: tuple[float, float] | None, limit: float, angular: bool) -> tuple[str, tuple[tuple[str, str], ...]]:
    """(text, (effect, loss) of each that is lost); travel: m or rad, None if unknown; limit: of the drive, V, infinite if unknown."""
    mass, effort, level = one_joint(model, limit)
    places = np.linspace(*(travel or ANYWHERE), PLACES)
    pull = along(model, places, "force") * math.copysign(1.0, model.gain)
    stiffness, offset = (float(value) for value in np.polyfit(places, pull, 1))
    reach = float(np.max(np.abs(pull)))
    straight = reach > 0.0 and stiffness > 0.0 and float(np.max(np.abs(stiffness * places + offset - pull))) <= STRAIGHT * reach
    lost = lost_in("SDF", model, [name for name, _ in model.effects if not (straight and _spring(model.library[name]))], travel)
    spring = f"<spring_reference>{-offset / stiffness:.9g}</spring_reference><spring_stiffness>{stiffness:.9g}</spring_stiffness>" if straight else ""
    between = f"<lower>{travel[0]:.9g}</lower><upper>{travel[1]:.9g}</upper>" if travel is not None else ""
    lines = [
        '<?xml version="1.0"?>',
        '<sdf version="1.9">',
        '  <model name="axis">',
        "    <!-- forces are in the unit of the input: the mass is kA, the damping kV -->",
        *(f"    <!-- lost: {effect}: {why} -->" for effect, why in lost),
        '    <link name="base"/>',
        '    <link name="axis">',
        f"      <inertial><mass>{mass:.9g}</mass>",
        f"        <inertia><ixx>{mass:.9g}</ixx><ixy>0</ixy><ixz>0</ixz><iyy>{mass:.9g}</iyy><iyz>0</iyz><izz>{mass:.9g}</izz></inertia>",
        "      </inertial>",
        "    </link>",
        '    <joint name="ground" type="fixed"><parent>world</parent><child>base</child></joint>',
        f'    <joint name="axis_joint" type="{"revolute" if angular else "prismatic"}">',
        "      <parent>base</parent><child>axis</child>",
        f"      <axis><xyz>{'0 0 1' if angular else '1 0 0'}</xyz>",
        f"        <limit>{between}<effort>{effort:.9g}</effort>",
        f"          <velocity>{abs(model.gain) * effort:.9g}</velocity></limit>",
        f"        <dynamics><damping>{1.0 / abs(model.gain):.9g}</damping><friction>{level:.9g}</friction>{spring}</dynamics>",
        "      </axis>",
        "    </joint>",
        "  </model>",
        "</sdf>",
    ]
    return "\n".join(lines) + "\n", lost


def _spring(effect: Effect) -> bool:
    """Whether an effect is a force that depends on position alone."""
    return effect.category == "force" and asks(effect) - {"gain", "pole"} == {"x"}
