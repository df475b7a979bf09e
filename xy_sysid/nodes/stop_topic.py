"""The topic STOP, with the publisher of each message.

rclpy does not give callbacks the identity of a message's publisher (7.1: its message info has only times and sequence numbers), but ``rcl_take``
of its C library does. So these subscriptions are not part of the node's executor; ``listen`` takes the received messages.

Source: rmw/types.h, ``rmw_message_info_t``: source_timestamp, received_timestamp, publication_sequence_number and reception_sequence_number of
8 bytes each, then ``rmw_gid_t``: a pointer, and the bytes of the identity.
"""

from __future__ import annotations

import ctypes
import time
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.type_support import check_for_type_support
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from xy_sysid.errors import BadInput
from xy_sysid.excitation.stop_latch import StopLatch
from xy_sysid.nodes.common import STOP_HEARD, STOP_TOPIC
from xy_sysid.nodes.wall import Wall

NUMBER, IDENTITY = slice(16, 24), slice(40, 56)  # bytes of rmw_message_info_t
ROOM = 512  # bytes, more than the size of rmw_message_info_t
TAKEN = 0  # RCL_RET_OK
RELEASE = "~/release_stop"


class StopTopic:
    """Subscribes, and offers the service with which an operator overrides STOP. Raises BadInput without the C library of ROS 2."""

    def __init__(self, node: Node, wall: Wall) -> None:
        self._node, self._latch = node, StopLatch()
        self._names: dict[bytes, str] = {}
        try:
            self._take: Any = ctypes.CDLL("librcl.so").rcl_take
        except OSError as problem:
            raise BadInput("ROS 2", f"without librcl.so ({problem})", "rclpy on Linux", "STOP needs the identity of its publisher.") from None
        self._take.argtypes, self._take.restype = [ctypes.c_void_p] * 4, ctypes.c_int
        check_for_type_support(Bool)
        kind: Any = rclpy_implementation.Subscription
        with node.handle:
            self._heard = [kind(node.handle, Bool, STOP_TOPIC, quality.get_c_qos_profile()) for quality in STOP_HEARD]
        node.create_service(Trigger, RELEASE, wall.around(self._on_release))

    @property
    def held(self) -> bool:
        """True if STOP is on."""
        return bool(self._latch.holders)

    @property
    def holders(self) -> list[str]:
        """Names of the publishers that hold STOP."""
        return [self._name(one) for one in self._latch.holders]

    def listen(self) -> bool:
        """Take the received messages; returns whether STOP was requested since the last call, even if it is released again."""
        self._receive()
        return self._latch.asked()

    def _receive(self) -> None:
        for subscription in self._heard:
            with subscription:
                while self._one(subscription):
                    pass

    def close(self) -> None:
        """End the subscriptions."""
        for subscription in self._heard:
            subscription.destroy_when_not_in_use()
        self._heard.clear()

    def why(self) -> str:
        """A sentence on who holds STOP and what to do."""
        who = ", ".join(self.holders)
        return (
            f"STOP is on (topic {STOP_TOPIC}, from {who}): activate is refused until the same publisher sends false; "
            f"the service {self._node.get_name()}/release_stop overrides it"
        )

    def _one(self, subscription: Any) -> bool:
        message, info = ctypes.create_string_buffer(8), ctypes.create_string_buffer(ROOM)  # a Bool of C is one byte
        if self._take(subscription.pointer, message, info, None) != TAKEN:
            return False
        self._latch.heard(info.raw[IDENTITY], int.from_bytes(info.raw[NUMBER], "little"), message.raw[0] != 0)
        return True

    def _look(self) -> set[bytes]:
        """The present publishers; their names are kept, because a message may arrive before its sender's name, and the sender may end."""
        present = set()
        for info in self._node.get_publishers_info_by_topic(self._node.resolve_topic_name(STOP_TOPIC)):
            publisher = bytes(info.endpoint_gid)[: IDENTITY.stop - IDENTITY.start]
            present.add(publisher)
            if "UNKNOWN" not in info.node_name:
                self._names[publisher] = info.node_name
        return present

    def _name(self, publisher: bytes) -> str:
        gone = "" if publisher in self._look() else " (gone)"
        return self._names.get(publisher, "a publisher without a name") + gone

    def _on_release(self, _request: Any, response: Any) -> Any:
        self._receive()  # a STOP among these messages is obeyed at the next ``listen``
        response.success, response.message = self._latch.release(time.monotonic(), self._name)
        self._node.get_logger().warning(response.message)
        return response
