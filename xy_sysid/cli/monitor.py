"""Subscribes to the topics of the identifier and controls the lifecycle of the excitation; all results of the demo arrive over DDS."""

from __future__ import annotations

import os
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput
from xy_sysid.live.plain_messages import ArrayMessage, topic_of
from xy_sysid.nodes.common import LATCHED_QOS, NAMESPACE
from xy_sysid.nodes.convert import array_from_ros
from xy_sysid.nodes.own_context import OwnContext
from xy_sysid.nodes.wall import Wall

LISTENERS = 3  # subscribers of voltage: machine, identifier, diagnoser; of position: excitation, identifier, diagnoser
QUIET = 1.0  # s without a new result after which the last one has arrived


class Monitor(OwnContext):
    """A node that receives results and statuses; call ``spin`` often."""

    def __init__(self, axes: tuple[str, ...], listeners: int = LISTENERS) -> None:
        super().__init__("demo", NAMESPACE)
        self._listeners = listeners
        self.arrays: dict[str, ArrayMessage] = {}
        self.statuses: dict[str, tuple[int, str, dict[str, str]]] = {}
        self.changed = time.monotonic()
        self._wall = Wall(lambda words: self._node.get_logger().error(words))
        for axis in axes:
            for kind in ("frf", "transfer_function", "comparison"):
                self._listen(topic_of(kind, axis))
        self._node.create_subscription(DiagnosticArray, "metrics", self._wall.around(self._on_statuses), 100)
        self._client = self._node.create_client(ChangeState, "excitation/change_state")
        self._wanted = [Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE]
        self._call: Any = None

    def _listen(self, topic: str) -> None:
        quality: Any = LATCHED_QOS if topic.startswith("transfer") else 10

        def heard(message: Float64MultiArray) -> None:
            self.arrays[topic] = array_from_ros(topic, message)
            self.changed = time.monotonic()

        self._node.create_subscription(Float64MultiArray, topic, self._wall.around(heard), quality)

    def _on_statuses(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            self.statuses[status.name] = (level, status.message, {pair.key: pair.value for pair in status.values})
            if status.name.startswith("axis "):
                self.changed = time.monotonic()

    def others(self, seconds: float = 1.5) -> list[str]:
        """Names of other nodes that use the machine's topics in this domain; seconds: time for discovery."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._executor.spin_once(timeout_sec=0.1)
        found = []
        for topic in (f"{NAMESPACE}/voltage", f"{NAMESPACE}/position"):
            infos = self._node.get_publishers_info_by_topic(topic) + self._node.get_subscriptions_info_by_topic(topic)
            found += [f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos]
        return sorted(set(found))

    def spin(self, seconds: float) -> None:
        """Receive messages for this time, s."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def client(self, kind: Any, service: str) -> Any:
        """A client of a service, to be called between two calls of ``spin``."""
        return self._node.create_client(kind, service)

    def start_when_ready(self) -> None:
        """Configure and activate the excitation once all nodes are connected: discovery can take seconds."""
        if not self._wanted or "streams" not in self.statuses or not self._client.service_is_ready():
            return
        for name in ("excitation", "ballscrew"):
            if int(self.statuses.get(name, (0, "", {}))[2].get("listeners", "0")) < self._listeners:
                return
        if self._call is not None and not self._call.done():
            return
        if self._call is not None and self._call.result() is not None and self._call.result().success:
            self._wanted.pop(0)
            self._call = None
        if self._wanted:
            self._call = self._client.call_async(ChangeState.Request(transition=Transition(id=self._wanted[0])))

    def over(self) -> bool:
        """True if the excitation has ended and the last results have arrived."""
        state = self.statuses.get("excitation", (0, "", {}))[2].get("state", "")
        return state == "stopped" and time.monotonic() - self.changed > QUIET


def refuse_others(monitor: Monitor) -> None:
    """Raises BadInput, and closes the monitor, if another machine is in this domain: it might be a real one."""
    others = monitor.others()
    if others:
        monitor.close()
        raise BadInput(
            "ROS domain",
            f"{os.environ.get('ROS_DOMAIN_ID', '0')}, where {', '.join(others)} use the machine's topics",
            "a domain without a machine, so that the demo drives nothing real",
            "Choose another with ROS_DOMAIN_ID=<1..100>.",
        )
