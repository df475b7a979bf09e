"""A subscription that hears every publisher: reliable as long as all of them are, best effort as soon as one is not.

A reliable subscription hears nothing at all of a best-effort publisher, as drivers of sensors often are; a best-effort
one loses samples of ours, which come in bursts of thousands when a simulated machine runs as fast as it goes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from xy_sysid.nodes.quality import overridden

LOOK = 0.2  # s between two looks for a publisher that offers something else


class Ear:
    """Subscribes, and subscribes again when what the publishers offer has changed."""

    def __init__(self, node: Node, kind: Any, topic: str, callback: Callable[[Any], None], quality: QoSProfile) -> None:
        """quality: depth and history; the reliability is that of the publishers."""
        self._node, self._kind, self._callback, self._quality = node, kind, callback, quality
        self._reliable = True
        self._told = "reliability" in overridden(node, topic, "subscription")  # by the user, who is not overruled
        self._subscription = self._subscribe(topic)
        self._topic = topic
        self._look()
        node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def topic_name(self) -> str:
        """With its namespace."""
        return str(self._subscription.topic_name)

    def get_publisher_count(self) -> int:
        """How many are there, heard or not."""
        return self._node.count_publishers(self.topic_name)

    def _subscribe(self, topic: str) -> Any:
        quality = QoSProfile(
            depth=self._quality.depth,
            history=self._quality.history,
            reliability=ReliabilityPolicy.RELIABLE if self._reliable else ReliabilityPolicy.BEST_EFFORT,
        )
        return self._node.create_subscription(self._kind, topic, self._callback, quality)

    def _look(self) -> None:
        offers = self._node.get_publishers_info_by_topic(self.topic_name)
        reliable = all(offer.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT for offer in offers)
        if not offers or reliable == self._reliable or self._told:
            return
        self._reliable = reliable
        before, self._subscription = self._subscription, self._subscribe(self._topic)
        self._node.destroy_subscription(before)
        self._node.get_logger().info(f"{self.topic_name}: heard {'reliably' if reliable else 'with best effort, as one publisher offers no more'}")
