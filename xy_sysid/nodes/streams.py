"""The subscriptions of a node to the streams of a machine: voltage and position, as blocks or joint states."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.live.heard import Heard
from xy_sysid.live.recent import Recent
from xy_sysid.nodes.common import DATA_QOS
from xy_sysid.nodes.convert import from_message
from xy_sysid.nodes.hearing import Ear
from xy_sysid.processes.terminal import printable
from xy_sysid.response.methods import METHODS
from xy_sysid.samples.block import Block, StreamName
from xy_sysid.samples.integral import integrated
from xy_sysid.samples.joint_fields import JointReader, joints_of
from xy_sysid.samples.joint_states import JointCounter
from xy_sysid.samples.pairing import QUANTITIES
from xy_sysid.settings import DiagnoserSettings, IdentifierSettings, given
from xy_sysid.units import USUAL

JOINT_QOS = QoSProfile(depth=20_000, history=HistoryPolicy.KEEP_LAST)  # ten seconds of single samples at 2 kHz
HEARING = ("source", "output", "effort_as_voltage", "joints", "joint_topic", "effort_lag", "input_unit", "output_unit")  # fixed from the start


class Streams:
    """Subscribes, and passes every valid block on.

    refused: why the last message was refused, empty if none was; refusals: their number
    """

    def __init__(
        self, node: Node, axes: tuple[str, ...], settings: IdentifierSettings | DiagnoserSettings, feed: Callable[[Any, Block], None]
    ) -> None:
        """settings: source, output, effort_as_voltage, joints, ...; feed: called with stream and block. Raises BadInput for unknown joints."""
        source, effort = settings.source, settings.effort_as_voltage
        self._lag = settings.effort_lag
        self._reader = JointReader(joints_of(axes, given(settings.joints)), settings.output, effort)
        if effort and settings.units == USUAL:
            words = "joint states name no unit: effort is taken as V and position as m; set input_unit and output_unit, for example to N m and rad"
            node.get_logger().warning(words)
        if source == "joint_state" and settings.output == "velocity":
            node.get_logger().info(integrated(settings.units.speed))
        self._node, self._axes, self._effort, self._output, self._give = node, axes, effort, settings.output, feed
        self._streams = METHODS[settings.response].streams if isinstance(settings, IdentifierSettings) else QUANTITIES
        self.forget()
        self._by_stamp = source == "joint_state"
        if self._by_stamp:
            Ear(node, JointState, settings.joint_topic, self._on_joints, JOINT_QOS)
        else:
            Ear(node, Float64MultiArray, "position", self._on_position, DATA_QOS)
        if source == "blocks" or not effort:
            Ear(node, Float64MultiArray, "voltage", self._on_voltage, DATA_QOS)
        if "reference" in self._streams:
            Ear(node, Float64MultiArray, "reference", self._on_reference, DATA_QOS)

    def forget(self) -> None:
        """Delete the state of the streams: rate and counter of joint states, and refusals."""
        self.refused, self.refusals = "", 0
        self.recent = Recent()
        self._joints = JointCounter(self._axes, with_voltage=not self._effort, output=self._output)
        self._heard = dict.fromkeys(self._streams, 0)
        self._before = dict(self._heard)
        self._paired = 0  # samples, at the last look

    def heard(self, samples: int, sentences: Mapping[str, str], faults: Mapping[str, int]) -> Heard:
        """The reception since the last call; samples: paired since the start; sentences, faults: texts of the pairing and their numbers, by reason.

        A fault that has not occurred again for some seconds is left out.
        """
        now = time.monotonic()
        going_on = {why: text for why, text in sentences.items() if self.recent.goes_on(why, (text, faults.get(why, 0)), now)}
        silent = tuple(kind for kind in self._streams if self._heard[kind] == self._before[kind])
        paired, self._paired = samples - self._paired, samples
        self._before = dict(self._heard)
        return Heard(
            streams=self._streams,
            silent=silent,
            paired=max(paired, 0),
            refused=self.refused if self.recent.goes_on("refused", self.refusals, now) else "",
            refusals=self.refusals,
            stamps=self._joints.wrong() if self._by_stamp and self._heard["position"] else "",
            sentences=going_on,
        )

    def _on_voltage(self, message: Float64MultiArray) -> None:
        self._on_block("voltage", message)

    def _on_position(self, message: Float64MultiArray) -> None:
        self._on_block("position", message)

    def _on_reference(self, message: Float64MultiArray) -> None:
        self._on_block("reference", message)

    def _on_block(self, kind: StreamName, message: Float64MultiArray) -> None:
        self._heard[kind] += 1
        try:
            block = from_message(message)
        except BadInput as problem:
            self._refuse(f"{kind}: {problem}")
            return
        self._give(kind, block)
        if kind == "voltage" and self._by_stamp:
            self._joints.see_voltage(block)

    def _on_joints(self, message: JointState) -> None:
        if self._reader.of_others(message):
            return
        self._heard["position"] += 1
        if self._effort:
            self._heard["voltage"] += 1
        wrong = self._reader.wrong(message)
        if wrong:
            self._refuse(wrong)
            return
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        block = self._joints.add(stamp, self._reader.row(message))
        if block is None:
            return
        number = len(self._axes)
        self._give("position", Block(self._axes, block.seq, block.time, block.values[:, :number]))
        if self._effort:
            known = block.seq >= self._lag
            self._give("voltage", Block(self._axes, block.seq[known] - self._lag, block.time[known], block.values[known, number:]))

    def _refuse(self, text: str) -> None:
        if self.refused != text:
            self._node.get_logger().warning(printable(text))
        self.refused, self.refusals = text, self.refusals + 1


def answered(act: Callable[[], str], _request: Any, response: Any) -> Any:
    """The response of a Trigger service: the text of ``act``, or of its error."""
    try:
        response.message, response.success = act(), True
    except (XySysidError, OSError) as problem:
        response.message, response.success = str(problem), False
    return response
