"""Rows that ``ros2 topic echo --csv`` prints of joint states: a stamp, a frame, the joints' names and their numbers, without a header.

Source: ``rosidl_runtime_py.convert.message_to_csv``, which writes the fields in order, and an empty cell for an empty array.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.imports.sheet import Column

BEFORE = ("sec", "nanosec", "frame_id")
ORDER = ("position", "velocity", "effort")  # as in sensor_msgs/JointState; each may be empty


def joint_states(cells: list[str]) -> list[str] | None:
    """Names of the columns, from the cells of the first row; None if it is no joint state."""
    if len(cells) < 5 or not (cells[0].isdigit() and cells[1].isdigit() and int(cells[1]) < 10**9):
        return None
    rest = cells[len(BEFORE) :]
    count = next((place for place, cell in enumerate(rest) if not cell or _is_number(cell)), 0)
    joints, rest = rest[:count], rest[count:]
    if not joints or len(set(joints)) < count:
        return None
    names = [*BEFORE, *(f"{joint}_name" for joint in joints)]
    for kind in ORDER:
        if rest and not rest[0]:
            names.append(f"no_{kind}")
            rest = rest[1:]
        elif rest:
            names += [f"{joint}_{kind}" for joint in joints]
            if len(rest) < count or not all(map(_is_number, rest[:count])):
                return None
            rest = rest[count:]
    return None if rest else names


def stamped(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """The columns with both parts of the stamp as one time, s since the second of the first row."""
    seconds, parts, *rest = columns
    since = seconds.values - (seconds.values[0] if seconds.values.size else 0.0)
    return Column("time", "s", np.asarray(since + 1e-9 * parts.values)), *rest


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
