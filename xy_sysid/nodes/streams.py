"""What a node that listens to a machine has: its axes, and the streams of voltage and position, as blocks or joint states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.joints import JointCounter
from xy_sysid.nodes.common import DATA_QOS, from_message, overrides
from xy_sysid.pairing import KINDS, Kind
from xy_sysid.stream import Block

JOINT_QOS = QoSProfile(depth=20_000, history=HistoryPolicy.KEEP_LAST)  # ten seconds of single samples at 2 kHz
AXES = "axes"


def declare_axes(node: Node) -> tuple[str, ...]:
    """The parameter ``axes``, x and y by default; raises BadInput if it is no list of names."""
    axes = overrides(node).get(AXES, ["x", "y"])
    if not isinstance(axes, list) or not axes or not all(isinstance(axis, str) and axis for axis in axes):
        raise BadInput(f"node {node.get_name()}: parameter {AXES}", axes, 'a list of names like ["x", "y"]', "Change it and try again.")
    if not node.has_parameter(AXES):
        node.declare_parameter(AXES, axes)
    return tuple(axes)


class Streams:
    """Subscribes, refuses in words what is no block, and feeds the rest on.

    refused: why the last message was refused, empty if none was; refusals: how many were
    """

    def __init__(self, node: Node, axes: tuple[str, ...], source: str, effort: bool, feed: Callable[[Kind, Block], None]) -> None:
        """source: blocks or joint_state; effort: take the input from the joint states; feed: gets every block."""
        self.refused, self.refusals = "", 0
        self._node, self._axes, self._effort, self._give = node, axes, effort, feed
        self._joints = JointCounter(axes, with_voltage=not effort)
        self._heard = dict.fromkeys(KINDS, 0)
        self._before = dict(self._heard)
        self._by_stamp = source == "joint_state"
        if self._by_stamp:
            node.create_subscription(JointState, "joint_states", self._on_joints, JOINT_QOS)
        else:
            node.create_subscription(Float64MultiArray, "position", self._on_position, DATA_QOS)
        if source == "blocks" or not effort:
            node.create_subscription(Float64MultiArray, "voltage", self._on_voltage, DATA_QOS)

    def silent(self) -> list[Kind]:
        """The streams of which nothing was heard since the last call."""
        found = [kind for kind in KINDS if self._heard[kind] == self._before[kind]]
        self._before = dict(self._heard)
        return found

    def _on_voltage(self, message: Float64MultiArray) -> None:
        self._on_block("voltage", message)

    def _on_position(self, message: Float64MultiArray) -> None:
        self._on_block("position", message)

    def _on_block(self, kind: Kind, message: Float64MultiArray) -> None:
        try:
            block = from_message(message)
        except BadInput as problem:
            self._refuse(f"{kind}: {problem}")
            return
        self._feed(kind, block)
        if kind == "voltage" and self._by_stamp:
            self._joints.see_voltage(block)

    def _on_joints(self, message: JointState) -> None:
        missing = [axis for axis in self._axes if axis not in message.name]
        places = [] if missing else [message.name.index(axis) for axis in self._axes]
        effort = self._effort
        if missing or len(message.position) != len(message.name) or (effort and len(message.effort) != len(message.name)):
            what = f"joints {', '.join(message.name)}" if missing else "a position" + (" and an effort" if effort else "") + " for some joints only"
            self._refuse(f"joint_states: {what}; expected {', '.join(self._axes)}. Set the parameter axes to joint names.")
            return
        time = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        row = [message.position[k] for k in places] + ([message.effort[k] for k in places] if effort else [])
        block = self._joints.add(time, np.array(row, dtype=np.float64))
        if block is None:
            return
        number = len(self._axes)
        self._feed("position", Block(self._axes, block.seq, block.time, block.values[:, :number]))
        if effort:
            self._feed("voltage", Block(self._axes, block.seq, block.time, block.values[:, number:]))

    def _feed(self, kind: Kind, block: Block) -> None:
        self._heard[kind] += len(block)
        self._give(kind, block)

    def _refuse(self, text: str) -> None:
        if self.refused != text:
            self._node.get_logger().warning(text)
        self.refused, self.refusals = text, self.refusals + 1


def answered(act: Callable[[], str], _request: Any, response: Any) -> Any:
    """The response of a Trigger service: what ``act`` says, or why it could not."""
    try:
        response.message, response.success = act(), True
    except (XySysidError, OSError) as problem:
        response.message, response.success = str(problem), False
    return response
