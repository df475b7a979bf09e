"""PX4 ULog, by pyulog. Every topic has its own time stamps; ``vehicle_torque_setpoint.xyz[0]`` is a field of a topic."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def leaves(path: str) -> Iterator[tuple[str, Any, str, str]]:
    """Fields of topics, with the instants of their topic."""
    from pyulog import ULog

    topics = ULog(path).data_list
    for topic in topics:
        several = sum(other.name == topic.name for other in topics) > 1
        name = f"{topic.name}[{topic.multi_id}]" if several else topic.name
        clock = f"time of {name}"
        yield clock, 1e-6 * topic.data["timestamp"], "s", ""
        for field, values in topic.data.items():
            if field != "timestamp":
                yield f"{name}.{field}", values, "", clock
