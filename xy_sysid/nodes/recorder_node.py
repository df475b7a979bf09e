"""Recorder node: writes topics to a bag as they arrive, serialized; complete up to the last second even if it is killed."""

from __future__ import annotations

import importlib
import re
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from xy_sysid.bags import BagWriter
from xy_sysid.bags.atomic import flushed
from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.nodes.common import WalledNode, declare
from xy_sysid.settings import RecorderSettings

LOOK = 0.2  # s between two checks for new topics
FLUSH = 1.0  # s between two commits to disk
DEPTH = 10_000  # most messages that wait while the disk is busy


class RecorderNode(WalledNode):
    """Subscribes to every topic that a pattern matches, as soon as a node publishes it."""

    def __init__(self) -> None:
        super().__init__("recorder")
        self._own = declare(self, RecorderSettings(), fixed=None)
        settings = self._own.settings
        try:
            self._patterns = [re.compile(pattern) for pattern in settings.topics]
        except re.error as problem:
            raise BadInput("node recorder: topics", problem.pattern, "regular expressions", f"{problem}; correct it.") from None
        output = settings.output or f"xy_{datetime.now():%Y-%m-%d_%H-%M-%S}"
        custom = {"machine": settings.machine} if settings.machine else None
        self._bag = BagWriter(Path(output).expanduser(), settings.storage, custom)
        self._heard: dict[str, int] = {}
        self._unknown: set[str] = set()
        self._started: float | None = None
        self.create_timer(LOOK, self._look)
        self.create_timer(FLUSH, self._flush)
        self.get_logger().info(f"recording to {self._bag.path}")
        self._look()

    def _look(self) -> None:
        """Subscribe to new topics that match."""
        space = self.get_namespace().rstrip("/") + "/"
        for topic, types in self.get_topic_names_and_types():
            name = topic.removeprefix(space)
            if topic in self._heard or topic in self._unknown or not any(pattern.fullmatch(name) for pattern in self._patterns):
                continue
            if self.count_publishers(topic) == 0:
                continue
            self._subscribe(topic, types[0])
        limit = self._own.settings.seconds
        if limit > 0 and self._started is not None and time.monotonic() - self._started >= limit:
            self.exit_code = 0

    def _subscribe(self, topic: str, kind: str) -> None:
        package, _, name = kind.partition("/msg/")
        try:
            found = getattr(importlib.import_module(f"{package}.msg"), name)
        except (ImportError, AttributeError):
            self._unknown.add(topic)
            self.get_logger().warning(f"{topic} is not recorded: its type {kind} is not installed")
            return
        self._heard[topic] = 0
        self.create_subscription(found, topic, self._writer(topic, kind), self._quality(topic), raw=True)
        self.get_logger().info(f"recording {topic}")

    def _quality(self, topic: str) -> QoSProfile:
        """The quality of service for a topic: reliable and latched only if all its publishers are."""
        offers = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
        reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
        latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        return QoSProfile(
            depth=DEPTH,
            history=HistoryPolicy.KEEP_LAST,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )

    def _writer(self, topic: str, kind: str) -> Callable[[Any], None]:
        def write(message: bytes) -> None:
            if self._started is None:
                self._started = time.monotonic()
            self._heard[topic] += 1
            try:
                self._bag.write_raw(topic, kind, message, time.time_ns())
            except (OSError, XySysidError) as problem:
                self.get_logger().fatal(f"{self._bag.path} cannot be written any more: {problem}")
                self.exit_code = 1

        return write

    def _flush(self) -> None:
        try:
            self._bag.flush()
        except OSError as problem:
            self.get_logger().fatal(f"{self._bag.path} cannot be written any more: {problem}")
            self.exit_code = 1

    def last_words(self) -> None:
        """Finish the bag and log its content."""
        self._bag.close()
        flushed(self._bag.path)
        numbers = ", ".join(f"{topic} {number}" for topic, number in sorted(self._heard.items())) or "nothing was published"
        self.get_logger().info(f"{self._bag.path}: {numbers}")
