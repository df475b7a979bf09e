"""A subscription that receives from every publisher: reliable while all of them are reliable, otherwise best effort.

A reliable subscription receives nothing from a best-effort publisher, such as many sensor drivers; a best-effort one loses
samples of these nodes, which come in bursts of thousands when a simulated machine runs as fast as it can.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from xy_sysid.nodes.quality import overridden

LOOK = 0.2  # s between two checks of the publishers' reliability


class Ear:
    """Subscribes, and subscribes again when the reliability of the publishers has changed."""

    def __init__(self, node: Node, kind: Any, topic: str, callback: Callable[[Any], None], quality: QoSProfile) -> None:
        """quality: depth and history; the reliability is that of the publishers."""
        self._node, self._kind, self._callback, self._quality = node, kind, callback, quality
        self._reliable = True
        self._told = "reliability" in overridden(node, topic, "subscription")  # by the user, whose choice is kept
        self._subscription = self._subscribe(topic)
        self._topic = topic
        self._look()
        node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def topic_name(self) -> str:
        """Name of the topic with its namespace."""
        return str(self._subscription.topic_name)

    def get_publisher_count(self) -> int:
        """Number of publishers, compatible or not."""
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
