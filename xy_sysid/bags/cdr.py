"""Offsets of the numbers in a serialized message (CDR, the encoding of ROS 2), and the bytes that prove them.

A ``Layout`` is read from one message. Any other message with the same length and the same fixed bytes (labels, sizes,
names; not stamps, numbers or padding, which is uninitialised memory) has its numbers at the same offsets.
Source: OMG DDSI-RTPS 2.5, section 10 (encapsulation), and DDS-XTypes 1.3, 7.4.1 (plain CDR).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from xy_sysid.samples.block import FloatArray

Bytes = NDArray[np.uint8]
ARRAY_TYPE = "std_msgs/msg/Float64MultiArray"
JOINT_TYPE = "sensor_msgs/msg/JointState"
HEADER = b"\x00\x01\x00\x00"  # plain CDR, little endian
BIG, LITTLE = 0, 1


class Unreadable(ValueError):
    """The bytes are not a message of the expected type."""


@dataclass(frozen=True, slots=True)
class Layout:
    """The shape shared by all messages whose fixed bytes are equal.

    size:     length of the message in bytes
    template: (size,) the message from which the layout was read
    fixed:    (size,) 255 for a byte that must equal the template, otherwise 0
    order:    "<" or ">", byte order of the numbers
    names:    the dimension labels of an array, or the joint names
    shape:    the dimension sizes of an array, empty for a joint state
    stamp:    offset of the header stamp (int32 s, uint32 ns), -1 if there is none
    parts:    (offset in bytes, count) of each run of doubles: data, or position, velocity, effort
    """

    size: int
    template: Bytes
    fixed: Bytes
    order: Literal["<", ">"]
    names: tuple[str, ...]
    shape: tuple[int, ...]
    stamp: int
    parts: tuple[tuple[int, int], ...]


class _Cursor:
    """Reads one message and records which bytes are structure."""

    def __init__(self, message: bytes) -> None:
        if len(message) < 4 or message[0] != 0 or message[1] not in (BIG, LITTLE):
            raise Unreadable("no plain CDR header")
        self.message, self.at = message, 4
        self.order: Literal["<", ">"] = "<" if message[1] == LITTLE else ">"
        self.fixed = np.zeros(len(message), np.uint8)
        self.fixed[:2] = 255

    def align(self, size: int) -> None:
        self.at += -(self.at - 4) % size

    def take(self, size: int, fixed: bool) -> int:
        start, self.at = self.at, self.at + size
        if self.at > len(self.message):
            raise Unreadable("the message ends early")
        if fixed:
            self.fixed[start : self.at] = 255
        return start

    def count(self, each: int) -> int:
        """A uint32: the number of items of at least ``each`` bytes that follow. Raises Unreadable if the message is too short for them."""
        self.align(4)
        number = int(struct.unpack_from(self.order + "I", self.message, self.take(4, True))[0])
        if number * each > len(self.message) - self.at:
            raise Unreadable("a count is larger than the message")
        return number

    def text(self) -> str:
        length = self.count(1)
        start = self.take(length, True)
        return self.message[start : start + length].rstrip(b"\0").decode("utf-8", "replace")

    def doubles(self) -> tuple[int, int]:
        number = self.count(8)
        if number:
            self.align(8)
        return self.take(8 * number, False), number

    def layout(self, names: list[str], shape: list[int], stamp: int, parts: list[tuple[int, int]]) -> Layout:
        if len(self.message) - self.at > 8:  # a few bytes of padding at the end are common
            raise Unreadable("the message is longer than its content")
        template = np.frombuffer(self.message, np.uint8)
        return Layout(
            size=len(self.message),
            template=template,
            fixed=self.fixed,
            order=self.order,
            names=tuple(names),
            shape=tuple(shape),
            stamp=stamp,
            parts=tuple(parts),
        )


def array_layout(message: bytes) -> Layout:
    """Layout of a std_msgs/Float64MultiArray; raises Unreadable."""
    cursor = _Cursor(message)
    names, shape = [], []
    for _ in range(cursor.count(12)):
        names.append(cursor.text())
        cursor.align(4)
        start = cursor.take(8, True)
        shape.append(int(struct.unpack_from(cursor.order + "I", message, start)[0]))
    cursor.align(4)
    skipped = int(struct.unpack_from(cursor.order + "I", message, cursor.take(4, True))[0])
    offset, number = cursor.doubles()
    if skipped > number:
        raise Unreadable("data_offset is larger than the data")
    return cursor.layout(names, shape, -1, [(offset + 8 * skipped, number - skipped)])


def joint_layout(message: bytes) -> Layout:
    """Layout of a sensor_msgs/JointState; raises Unreadable."""
    cursor = _Cursor(message)
    stamp = cursor.take(8, False)
    cursor.text()
    names = [cursor.text() for _ in range(cursor.count(4))]
    return cursor.layout(names, [], stamp, [cursor.doubles() for _ in range(3)])


def encode_array(labels: tuple[str, ...], sizes: tuple[int, ...], data: FloatArray) -> bytes:
    """A std_msgs/Float64MultiArray, row-major, with zeroed padding."""
    parts = [HEADER, struct.pack("<I", len(labels))]
    length = 8
    for index, (label, size) in enumerate(zip(labels, sizes, strict=True)):
        text = label.encode() + b"\0"
        stride = int(np.prod(sizes[index:]))
        item = struct.pack("<I", len(text)) + text + bytes(-len(text) % 4) + struct.pack("<II", size, stride)
        parts.append(item)
        length += len(item)
    parts.append(struct.pack("<II", 0, data.size))
    parts.append(bytes(-(length + 8 - 4) % 8) if data.size else b"")
    parts.append(np.ascontiguousarray(data, "<f8").tobytes())
    return b"".join(parts)
