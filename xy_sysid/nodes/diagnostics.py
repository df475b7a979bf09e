"""The status of a node: on ``metrics`` of its namespace, and on ``/diagnostics`` for monitors of the whole robot.

On /diagnostics names contain the node and its namespace, and hardware_id the machine, as in REP 107, so that two machines on one
network can be distinguished. STALE, which is reserved for the aggregator, becomes WARN.
"""

from __future__ import annotations

from collections.abc import Iterable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

GLOBAL = "/diagnostics"
WARN, STALE = DiagnosticStatus.WARN, DiagnosticStatus.STALE


class Diagnostics:
    """Publishes on both topics."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._own = node.create_publisher(DiagnosticArray, "metrics", 10)
        self._all = node.create_publisher(DiagnosticArray, GLOBAL, 10)

    def publish(self, statuses: Iterable[DiagnosticStatus]) -> None:
        """Publish the statuses, stamped now."""
        own = DiagnosticArray(status=list(statuses))
        own.header.stamp = self._node.get_clock().now().to_msg()
        self._own.publish(own)
        self._all.publish(DiagnosticArray(header=own.header, status=[self._known(item) for item in own.status]))

    def _known(self, item: DiagnosticStatus) -> DiagnosticStatus:
        """The status under a name that is unique on the network."""
        node, space = self._node.get_name(), self._node.get_namespace().strip("/")
        name = self._node.get_fully_qualified_name().strip("/")
        level = WARN if item.level == STALE else item.level
        return DiagnosticStatus(
            name=name if item.name == node else f"{name}: {item.name}",
            hardware_id=space or node,
            level=level,
            message=item.message,
            values=item.values,
        )
