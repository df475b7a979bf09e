"""The used fields of a joint state (sensor_msgs/JointState), and the reason why a message is not usable.

Drivers leave unknown fields empty or fill them with NaN: often the position of a wheel, and the effort of many drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

JointOutput = Literal["position", "velocity"]
JointField = Literal["position", "velocity", "effort"]
FIELDS: tuple[JointField, JointField, JointField] = ("position", "velocity", "effort")  # in the order of the message
PLURAL = {"position": "positions", "velocity": "velocities", "effort": "efforts"}
INSTEAD: dict[JointField, JointOutput] = {"position": "velocity", "velocity": "position"}


def joints_of(axes: tuple[str, ...], entries: tuple[str, ...]) -> dict[str, str]:
    """The joint of each axis, from entries like ``x=shoulder_pan_joint``; an axis without an entry has the name of its joint.

    Raises BadInput for an invalid entry, an unknown axis, and a joint or an axis named twice.
    """
    found = {axis: axis for axis in axes}
    named: set[str] = set()
    for entry in entries:
        axis, sign, joint = (part.strip() for part in entry.partition("="))
        if not sign or not joint or axis not in found or axis in named:
            raise BadInput("parameter joints", repr(entry), f"axis=joint, once for each of {', '.join(axes)}", "Change it and try again.")
        named.add(axis)
        found[axis] = joint
    if len(set(found.values())) < len(axes):
        raise BadInput("parameter joints", ", ".join(found.values()), "a joint of its own for each axis", "Change it and try again.")
    return found


class JointMessage(Protocol):
    """The fields of a joint state; the last three may be empty."""

    @property
    def name(self) -> Sequence[str]:
        """Names of the joints."""

    @property
    def position(self) -> Sequence[float]:
        """Position of each joint, m or rad."""

    @property
    def velocity(self) -> Sequence[float]:
        """Velocity of each joint, m/s or rad/s."""

    @property
    def effort(self) -> Sequence[float]:
        """Effort of each joint, N or N m."""


class JointReader:
    """wrong(message) -> why it is not usable, empty if it is; row(message) -> (wanted fields x joints,) numbers."""

    def __init__(self, joints: dict[str, str], output: JointOutput, effort: bool) -> None:
        """joints: the joint of each axis; output: the field used as output; effort: True if the effort is used, too."""
        self._axis, self._names = next(iter(joints)), tuple(joints.values())
        self._wanted: tuple[JointField, ...] = (output, "effort") if effort else (output,)
        self._heard = False
        self._known: set[JointField] = set()  # fields that had numbers for all joints; a later NaN is a fault of a single sample

    def of_others(self, message: JointMessage) -> bool:
        """True if a message has only other joints after ours have been received: other publishers, as of a gripper, may share the topic."""
        ours = not set(self._names).isdisjoint(message.name)
        self._heard = self._heard or ours
        return self._heard and not ours

    def wrong(self, message: JointMessage) -> str:
        """The missing data and how to provide it; empty if the message is usable."""
        missing = [name for name in self._names if name not in message.name]
        if missing:
            expected = f"joints {', '.join(message.name)}; expected {', '.join(self._names)}"
            return f'joint_states: {expected}. Set the parameter joints, for example to ["{self._axis}=NAME"].'
        for field in self._wanted:
            lack = self._lack(message, field)
            if lack:
                return f"joint_states: {lack}{self._advice(message, field)}"
        return ""

    def row(self, message: JointMessage) -> FloatArray:
        """The output of each joint, followed by the effort of each if it is used."""
        return np.concatenate([self._numbers(message, field) for field in self._wanted])

    def _numbers(self, message: JointMessage, field: JointField) -> FloatArray:
        values = getattr(message, field)
        return np.array([values[message.name.index(name)] for name in self._names], dtype=np.float64)

    def _lack(self, message: JointMessage, field: JointField) -> str:
        """The missing data of a field; empty if there are numbers."""
        number = len(getattr(message, field))
        if number != len(message.name):
            return f"{PLURAL[field]} are {'empty' if number == 0 else f'{number} for {len(message.name)} joints'}"
        if field not in self._known:
            there = np.isfinite(self._numbers(message, field))
            if not there.all():
                nameless = ", ".join(name for name, known in zip(self._names, there, strict=True) if not known)
                return f"{PLURAL[field]} of {nameless} are NaN"
            self._known.add(field)
        return ""

    def _advice(self, message: JointMessage, field: JointField) -> str:
        other = INSTEAD.get(field)
        if other is None:
            return "; this driver gives none. Set effort_as_voltage to false: the command, as blocks on voltage, is then the input."
        values = getattr(message, other)
        if len(values) == len(message.name) and np.isfinite(self._numbers(message, other)).all():
            return f"; this driver gives {other}. Set output to {other}."
        return f"; expected one for each of {', '.join(self._names)}. The driver must give them."
