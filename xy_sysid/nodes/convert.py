"""Plain messages and blocks of samples to ROS 2 messages and back: one codec for Float64MultiArray, one for DiagnosticStatus.

An array.array is copied at once; a list would be checked number by number.
"""

from __future__ import annotations

import functools
from array import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from xy_sysid.errors import BadInput
from xy_sysid.live.plain_messages import ArrayMessage, StatusMessage
from xy_sysid.samples.block import Block, FloatArray, columns, pack, unpack


@functools.lru_cache(maxsize=64)
def _layout(labels: tuple[str, ...], sizes: tuple[int, ...]) -> MultiArrayLayout:
    """The layout: two dimensions are rows and columns; otherwise each one describes a consecutive part of the data."""
    strides = (sizes[0] * sizes[1], sizes[1]) if len(sizes) == 2 else sizes
    named = zip(labels, sizes, strides, strict=True)
    return MultiArrayLayout(dim=[MultiArrayDimension(label=label, size=size, stride=stride) for label, size, stride in named])


def _array(labels: tuple[str, ...], sizes: tuple[int, ...], data: FloatArray) -> Float64MultiArray:
    return Float64MultiArray(layout=_layout(labels, sizes), data=array("d", np.ascontiguousarray(data, dtype=np.float64).tobytes()))


def array_to_ros(message: ArrayMessage) -> Float64MultiArray:
    """The Float64MultiArray of a plain message."""
    return _array(message.labels, message.sizes, message.data)


def array_from_ros(topic: str, message: Float64MultiArray) -> ArrayMessage:
    """The plain form of a message on a topic."""
    dims = message.layout.dim
    return ArrayMessage(topic, tuple(d.label for d in dims), tuple(int(d.size) for d in dims), np.frombuffer(message.data, dtype=np.float64).copy())


def to_message(block: Block) -> Float64MultiArray:
    """The block as a message."""
    return _array(("sample", columns(block.axes)), (len(block), 2 + len(block.axes)), pack(block))


def from_message(message: Float64MultiArray) -> Block:
    """The block in a message; raises BadInput if its layout is not two dimensions with the columns named."""
    dim = message.layout.dim
    if len(dim) != 2:
        raise BadInput("layout.dim", f"{len(dim)} dimensions", "2: rows and named columns", "Set layout.dim.")
    return unpack(dim[1].label, dim[0].size, dim[1].size, np.frombuffer(message.data, dtype=np.float64))


def statuses_to_ros(statuses: list[StatusMessage], stamp: Any, hardware: str = "") -> DiagnosticArray:
    """The DiagnosticArray of some statuses."""
    out = DiagnosticArray(status=[status_to_ros(item, hardware) for item in statuses])
    out.header.stamp = stamp
    return out


def status_to_ros(item: StatusMessage, hardware: str = "") -> DiagnosticStatus:
    """The DiagnosticStatus of a plain status."""
    values = [KeyValue(key=key, value=value) for key, value in item.values]
    return DiagnosticStatus(level=bytes([item.level]), name=item.name, message=item.message, hardware_id=hardware, values=values)


def status(name: str, level: int, message: str, values: Mapping[str, str]) -> DiagnosticStatus:
    """The DiagnosticStatus of a node itself, from level, sentence and named values."""
    return status_to_ros(StatusMessage(name, level, message, tuple(values.items())), name)
