"""A refined model as URDF: mass, damping, friction and limits of one joint; everything else is named in a comment."""

from __future__ import annotations

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.laws import lost_in, one_joint

ENDLESS = 1e16  # m: URDF requires a limit, also of a joint without one; this is the default of SDF


def urdf(model: AxisModel, travel: tuple[float, float] | None, limit: float, angular: bool) -> tuple[str, tuple[tuple[str, str], ...]]:
    """(text, (effect, loss) of each that is lost); travel: m or rad, None if unknown; limit: of the drive, V, infinite if unknown."""
    mass, effort, level = one_joint(model, limit)
    lost = lost_in("URDF", model, [name for name, _ in model.effects], travel)
    kind = ("continuous" if travel is None else "revolute") if angular else "prismatic"
    low, high = travel or (-ENDLESS, ENDLESS)
    axis = "0 0 1" if angular else "1 0 0"
    inertia = f'ixx="{mass:.9g}" ixy="0" ixz="0" iyy="{mass:.9g}" iyz="0" izz="{mass:.9g}"'
    lines = [
        '<?xml version="1.0"?>',
        '<robot name="axis">',
        "  <!-- forces are in the unit of the input: the mass is kA, the damping kV -->",
        *(f"  <!-- lost: {effect}: {why} -->" for effect, why in lost),
        '  <link name="base"/>',
        '  <link name="axis">',
        f'    <inertial><origin xyz="0 0 0"/><mass value="{mass:.9g}"/><inertia {inertia}/></inertial>',
        "  </link>",
        f'  <joint name="axis" type="{kind}">',
        f'    <parent link="base"/><child link="axis"/><axis xyz="{axis}"/>',
        f'    <limit lower="{low:.9g}" upper="{high:.9g}" effort="{effort:.9g}" velocity="{abs(model.gain) * effort:.9g}"/>',
        f'    <dynamics damping="{1.0 / abs(model.gain):.9g}" friction="{level:.9g}"/>',
        "  </joint>",
        "</robot>",
    ]
    return "\n".join(lines) + "\n", lost
