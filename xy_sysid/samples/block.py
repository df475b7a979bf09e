"""A block of consecutive samples, as in one std_msgs/Float64MultiArray.

Rows are samples; columns are ``seq,time`` and then one per axis. This file does not depend on ROS: a message is its column names
and its numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput

FloatArray = NDArray[np.float64]
SEQ, TIME = "seq", "time"
StreamName = Literal["voltage", "position", "reference"]


@dataclass(frozen=True, slots=True)
class Block:
    """Consecutive samples of one quantity.

    axes:   names of the axes, one per column of ``values``
    seq:    (n,) sample counter since the start of the source, whole numbers
    time:   (n,) sample instants, s
    values: (n, axes), V or m
    """

    axes: tuple[str, ...]
    seq: FloatArray
    time: FloatArray
    values: FloatArray

    def __len__(self) -> int:
        return int(self.seq.shape[0])

    def rows(self, first: int, last: int) -> Block:
        """The samples from ``first`` to before ``last``."""
        return Block(self.axes, self.seq[first:last], self.time[first:last], self.values[first:last])


@dataclass(frozen=True, slots=True)
class Samples:
    """Consecutive paired samples.

    seq:      counter of the first
    voltage:  (n, axes)
    position: (n, axes)
    time:     (n,) stamps of the position, s, if they are known
    reference: (n, axes) the controller's reference at that time, if requested
    """

    seq: int
    voltage: FloatArray
    position: FloatArray
    time: FloatArray | None = None
    reference: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.voltage.shape[0])

    def rows(self, first: int, last: int) -> Samples:
        """The samples from index ``first`` to before ``last``."""
        part = slice(first, last)
        time, reference = (None if values is None else values[part] for values in (self.time, self.reference))
        return Samples(seq=self.seq + first, voltage=self.voltage[part], position=self.position[part], time=time, reference=reference)


def columns(axes: Sequence[str]) -> str:
    """The label of ``layout.dim[1]`` for these axes."""
    return ",".join((SEQ, TIME, *axes))


def pack(block: Block) -> FloatArray:
    """(n * (2 + axes),) row-major numbers of the message."""
    return np.column_stack((block.seq, block.time, block.values)).ravel()


def unpack(label: str, rows: int, width: int, data: FloatArray) -> Block:
    """The block in a message.

    label: ``layout.dim[1].label``; rows, width: the sizes of dim[0] and dim[1]; data: the message's numbers.
    Raises BadInput if the columns are not ``seq,time,<axis>...`` or the sizes do not fit the data.
    """
    axes = _axes(label)
    if width != 2 + len(axes) or rows < 0 or rows * width != data.size:
        raise BadInput(
            "block size", f"{rows} x {width} with {data.size} numbers", f"rows x {2 + len(axes)} columns", "Set layout.dim sizes to rows and columns."
        )
    table = np.asarray(data, dtype=np.float64).reshape(rows, width)
    return Block(axes, table[:, 0], table[:, 1], table[:, 2:])


@lru_cache(maxsize=64)
def _axes(label: str) -> tuple[str, ...]:
    names = [name.strip() for name in label.split(",")]
    if len(names) < 3 or names[0] != SEQ or names[1] != TIME or len(set(names)) != len(names):
        raise BadInput("column label", repr(label), "'seq,time,' and one name per axis", "Name the columns in layout.dim[1].label.")
    return tuple(names[2:])
