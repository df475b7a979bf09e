"""Content of ROS messages: labels, sizes and strides of arrays, names and levels of statuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.ros_tools import needs_ros

from xy_sysid.live.plain_messages import STALE, ArrayMessage, StatusMessage
from xy_sysid.samples.block import Block

pytestmark = needs_ros


def dimensions(message: Any) -> list[tuple[str, int, int]]:
    """Label, size and stride of each."""
    return [(dim.label, dim.size, dim.stride) for dim in message.layout.dim]


@pytest.mark.parametrize(("axes", "rows"), [(("x", "y"), 20), (("größe",), 1), (("a", "b", "c"), 0)])
def test_a_block_and_a_table_of_the_same_numbers_are_one_message(axes: tuple[str, ...], rows: int) -> None:
    """Rows of named columns, row-major, for any sender; and back without loss."""
    from xy_sysid.nodes.convert import array_from_ros, array_to_ros, from_message, to_message

    random = np.random.default_rng(rows)
    block = Block(axes, np.arange(rows, dtype=float), random.normal(size=rows), random.normal(size=(rows, len(axes))))
    message, width = to_message(block), 2 + len(axes)
    assert dimensions(message) == [("sample", rows, rows * width), (f"seq,time,{','.join(axes)}", width, width)]
    assert array_to_ros(array_from_ros("any", message)) == message
    back = from_message(message)
    assert back.axes == axes and np.array_equal(back.values, block.values) and np.array_equal(back.time, block.time)


def test_an_array_of_parts_has_the_size_of_each_as_its_stride() -> None:
    """A transfer function: numerator, denominator and delay in sequence."""
    from xy_sysid.nodes.convert import array_from_ros, array_to_ros

    message = array_to_ros(ArrayMessage("t", ("numerator", "denominator", "delay"), (2, 3, 1), np.arange(6.0)))
    assert dimensions(message) == [("numerator", 2, 2), ("denominator", 3, 3), ("delay", 1, 1)]
    back = array_from_ros("t", message)
    assert (back.labels, back.sizes, back.data.tolist()) == (("numerator", "denominator", "delay"), (2, 3, 1), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])


def test_a_status_carries_level_sentence_values_and_hardware() -> None:
    """A node's own status has the node as its hardware id, others the given one."""
    from xy_sysid.nodes.convert import status, status_to_ros

    own, other = status("excitation", 1, "a sentence", {"a (V)": "1"}), status_to_ros(StatusMessage("axis x", STALE, "s", ()), "identifier")
    assert (own.name, own.level, own.message, own.hardware_id) == ("excitation", b"\x01", "a sentence", "excitation")
    assert [(pair.key, pair.value) for pair in own.values] == [("a (V)", "1")]
    assert (other.name, other.level, other.hardware_id) == ("axis x", b"\x03", "identifier")
