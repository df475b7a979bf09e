"""Plain messages to ROS 2 messages and back. Assigning array.array is what keeps this cheap."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from xy_sysid.live.messages import ArrayMessage, StatusMessage


def array_to_ros(message: ArrayMessage) -> Float64MultiArray:
    """Labels, sizes and numbers of a Float64MultiArray."""
    out = Float64MultiArray()
    total = int(np.prod(message.sizes)) if len(message.sizes) == 2 else message.data.shape[0]
    strides = [total, message.sizes[-1]] if len(message.sizes) == 2 else list(message.sizes)
    out.layout.dim = [
        MultiArrayDimension(label=label, size=size, stride=stride) for label, size, stride in zip(message.labels, message.sizes, strides, strict=True)
    ]
    numbers = array("d")
    numbers.frombytes(np.ascontiguousarray(message.data, dtype=np.float64).tobytes())
    out.data = numbers
    return out


def array_from_ros(topic: str, message: Float64MultiArray) -> ArrayMessage:
    """The plain form of what came on a topic."""
    dims = message.layout.dim
    return ArrayMessage(topic, tuple(d.label for d in dims), tuple(int(d.size) for d in dims), np.frombuffer(message.data, dtype=np.float64).copy())


def statuses_to_ros(statuses: list[StatusMessage], stamp: Any, hardware: str = "") -> DiagnosticArray:
    """One DiagnosticArray."""
    out = DiagnosticArray(status=[status_to_ros(item, hardware) for item in statuses])
    out.header.stamp = stamp
    return out


def status_to_ros(item: StatusMessage, hardware: str = "") -> DiagnosticStatus:
    """One DiagnosticStatus."""
    values = [KeyValue(key=key, value=value) for key, value in item.values]
    return DiagnosticStatus(level=bytes([item.level]), name=item.name, message=item.message, hardware_id=hardware, values=values)
