"""A message of each type that the nodes send, as plain values, and its topic."""

from __future__ import annotations

import re
from dataclasses import dataclass

from xy_sysid.samples.block import FloatArray

OK, WARN, ERROR, STALE = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class ArrayMessage:
    """A Float64MultiArray: labels and sizes of its dimensions, and its numbers, row-major."""

    topic: str
    labels: tuple[str, ...]
    sizes: tuple[int, ...]
    data: FloatArray


@dataclass(frozen=True, slots=True)
class StatusMessage:
    """One diagnostic_msgs/DiagnosticStatus: level OK, WARN, ERROR or STALE, a sentence, named values."""

    name: str
    level: int
    message: str
    values: tuple[tuple[str, str], ...]


def topic_of(kind: str, axis: str) -> str:
    """``<kind>/<axis>``; characters that ROS does not allow in a name, as in joint-2 or left/wrist, become underscores."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", axis)
    return f"{kind}/{'_' if name[:1].isdigit() else ''}{name}"
