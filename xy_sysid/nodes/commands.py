"""The interface to a controller of ros2_control: periodic commands of one number per joint, and joint states.

These controllers (forward_command_controller, effort_controllers, velocity_controllers, position_controllers) take a
``std_msgs/Float64MultiArray`` with one number for each joint in their own order, without a layout, and hold the last one.
For controllers that take trajectories see ``trajectories``.
"""

from __future__ import annotations

import array
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput
from xy_sysid.excitation.drive import Drive
from xy_sysid.excitation.pacing import Clock
from xy_sysid.nodes.hearing import Ear
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.joint_fields import joints_of
from xy_sysid.settings import ExcitationSettings, given

COMMAND_QOS = QoSProfile(depth=1, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)  # only the newest command is used
STATE_QOS = QoSProfile(depth=10, history=HistoryPolicy.KEEP_LAST)  # guards use only the newest one
BLOCK_TOPICS = ("voltage", "position", "reference")  # last parts of the names of topics with blocks
SLEEP = 0.0002  # s by which a sleep may be late: the last part of a wait is in shorter sleeps


class Commands:
    """The controller's topic, and the received positions of the axes' joints.

    says: the type of the controller's messages
    """

    says: Any = Float64MultiArray

    def __init__(
        self, node: LifecycleNode, settings: ExcitationSettings, on_positions: Callable[[float, FloatArray], None], complain: Callable[[str], None]
    ) -> None:
        """on_positions: called with the stamp, s, and (axes,) positions; complain: called with a sentence.

        Raises BadInput for joints that do not match the axes, or a topic name that is used for blocks.
        """
        axes = tuple(settings.axes)
        if settings.command_topic.rpartition("/")[2] in BLOCK_TOPICS:
            raise BadInput(
                "command_topic", repr(settings.command_topic), "the topic of a controller", "Blocks are published under this name: choose another."
            )
        self._joints = tuple(joints_of(axes, given(settings.joints)).values())
        self._order = given(settings.controller_joints) or self._joints
        missing = [joint for joint in self._joints if joint not in self._order]
        if missing or len(set(self._order)) < len(self._order):
            allowed = f"each joint once, with {', '.join(self._joints)} among them"
            raise BadInput("controller_joints", ", ".join(self._order), allowed, "Write them as controllers.yaml has them.")
        self._others = tuple(joint for joint in self._order if joint not in self._joints)
        self._heard = False  # a joint of the axes has been received
        self._kept: dict[str, float] = {}  # positions that the other joints hold
        self._on_positions, self._complain, self._holds = on_positions, complain, settings.holds
        self.publisher = node.create_publisher(self.says, settings.command_topic, COMMAND_QOS)
        self.states = Ear(node, JointState, settings.joint_topic, self._on_states, STATE_QOS)

    def send(self, drive: Drive, values: FloatArray, at: float) -> bool:
        """Send the drive's newest values (axes,) for ROS time ``at``, s; returns False and sends nothing if a value is unknown."""
        return self._send(values)

    def rest(self, drive: Drive) -> None:
        """Send the safe output."""
        self._send(drive.safe)

    def _send(self, values: FloatArray) -> bool:
        numbers = self._of_all(values, self._kept if self._holds else dict.fromkeys(self._others, 0.0))
        if not np.isfinite(numbers).all():
            return False
        self.publisher.publish(Float64MultiArray(data=array.array("d", numbers)))
        return True

    def _of_all(self, values: FloatArray, others: Mapping[str, float]) -> FloatArray:
        """(..., joints) in the controller's order, from (..., axes) values; NaN where unknown."""
        known = dict(zip(self._joints, np.moveaxis(values, -1, 0), strict=True))
        return np.stack([known.get(joint, np.full(values.shape[:-1], others.get(joint, np.nan))) for joint in self._order], axis=-1)

    def _on_states(self, message: JointState) -> None:
        ours = not set(self._joints).isdisjoint(message.name)
        self._heard = self._heard or ours
        if self._heard and not set(self._order) & set(message.name):
            return  # from another publisher on the topic
        if len(message.position) != len(message.name):
            self._complain(f"joint states: {len(message.name)} joints with {len(message.position)} positions")
            return
        places = dict(zip(message.name, message.position, strict=True))
        missing = [joint for joint in self._joints if joint not in places]
        if missing and self._heard and not ours:
            self._keep(places)
            return
        if missing:
            self._complain(f"joint states: no {', '.join(missing)} among {', '.join(message.name)}; set the parameter joints")
            return
        self._keep(places)
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        self._on_positions(stamp, np.array([places[joint] for joint in self._joints], dtype=np.float64))

    def _keep(self, places: dict[str, float]) -> None:
        for joint in self._others:
            if joint in places and np.isfinite(places[joint]):
                self._kept.setdefault(joint, places[joint])

    def forget(self) -> None:
        """Delete the positions of the other joints, which may differ at the next start."""
        self._kept.clear()


class Beat:
    """A thread that calls ``step(skipped)`` once per period, s, of the steady clock; skipped: number of periods missed before."""

    def __init__(self, period: float, step: Callable[[int], None]) -> None:
        self.clock = Clock(period, time.monotonic())
        self._step, self._over = step, threading.Event()
        self._thread = threading.Thread(target=self._run, name="commands", daemon=True)
        self._thread.start()

    @property
    def alive(self) -> bool:
        """True while the thread runs."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop; no step starts after this."""
        self._over.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        while not self._over.is_set():
            now = time.monotonic()
            due = self.clock.due(now)
            if due == 0:
                wait = self.clock.start + self.clock.sent * self.clock.period - now
                time.sleep(max(wait - SLEEP, SLEEP / 4))
                continue
            self.clock.sent += due - 1
            self.clock.late += due - 1
            self._step(due - 1)
            self.clock.count(now)
