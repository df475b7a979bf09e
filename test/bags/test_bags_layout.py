"""Messages are converted to arrays without deserializing each, and always correctly."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bag_making import STORE, joint_state, numbered

from xy_sysid.bags.cdr import ARRAY_TYPE, Layout, Unreadable, array_layout, encode_array, joint_layout
from xy_sysid.bags.stride import Batch, Reader, doubles, stamps
from xy_sysid.samples.block import columns, pack


def a_batch(messages: list[bytes]) -> Batch:
    length = np.array([len(message) for message in messages], np.int64)
    zeros = np.zeros(len(messages), np.int64)
    return Batch(zeros, zeros, np.cumsum(length) - length, length, np.frombuffer(b"".join(messages), np.uint8))


def block_message(first: int, rows: int = 20, axes: tuple[str, ...] = ("x", "y")) -> bytes:
    return encode_array(("sample", columns(axes)), (rows, 2 + len(axes)), pack(numbered(first, rows, axes)))


@pytest.mark.parametrize("axes", [("x",), ("x", "y"), ("carriage", "y", "spindle_2")])
@pytest.mark.parametrize("rows", [0, 1, 20])
def test_an_encoded_block_is_what_rosbags_reads(axes: tuple[str, ...], rows: int) -> None:
    """A message encoded here deserializes elsewhere to the same labels, sizes, strides and numbers."""
    message = STORE.deserialize_cdr(block_message(7, rows, axes), ARRAY_TYPE)
    assert [(d.label, d.size, d.stride) for d in message.layout.dim] == [
        ("sample", rows, rows * (2 + len(axes))),
        ("seq,time," + ",".join(axes), 2 + len(axes), 2 + len(axes)),
    ]
    np.testing.assert_array_equal(message.data, pack(numbered(7, rows, axes)))


@pytest.mark.parametrize("little", [True, False])
def test_a_layout_says_where_the_numbers_are(little: bool) -> None:
    """Numbers are found by layout in messages of either byte order."""
    content = STORE.deserialize_cdr(block_message(3), ARRAY_TYPE)
    raw = bytes(STORE.serialize_cdr(content, ARRAY_TYPE, little_endian=little))
    reader = Reader(array_layout)
    (stretch,) = reader.stretches(a_batch([raw, raw]))
    np.testing.assert_array_equal(doubles(a_batch([raw, raw]), stretch, 0), [pack(numbered(3))] * 2)


def test_a_joint_state_gives_stamp_position_and_effort() -> None:
    """Fields of any length before the numbers do not change the result."""
    random = np.random.default_rng(1)
    position, effort = random.normal(size=(50, 3)), random.normal(size=(50, 3))
    names = ("a", "lift_joint", "c3")
    for frame in ("", "b", "base", "a_longer_frame"):
        raw = [joint_state(1_700_000_000_000_000_123 + i * 500_000, position[i], effort[i], names, frame) for i in range(50)]
        batch = a_batch(raw)
        (stretch,) = Reader(joint_layout).stretches(batch)
        assert stretch.layout is not None and stretch.layout.names == names
        np.testing.assert_array_equal(doubles(batch, stretch, 0), position)
        np.testing.assert_array_equal(doubles(batch, stretch, 2), effort)
        assert stamps(batch, stretch).tolist() == [1_700_000_000_000_000_123 + i * 500_000 for i in range(50)]


def test_padding_is_not_looked_at() -> None:
    """Padding is uninitialised memory: messages that differ only in padding have one layout."""
    plain = joint_state(5, np.array([1.0, 2.0]), None, ("x", "y"), "odd")
    fixed = joint_layout(plain).fixed
    numbers = {i for offset, count in joint_layout(plain).parts for i in range(offset, offset + 8 * count)} | set(range(4, 12))
    padding = [i for i in range(len(plain)) if not fixed[i] and i not in numbers]
    assert padding, "this message was chosen because it has padding"
    dirty = bytearray(plain)
    for index in padding:
        dirty[index] ^= 0xA5
    assert len(list(Reader(joint_layout).stretches(a_batch([plain, bytes(dirty), plain])))) == 1


def test_a_changed_label_is_a_new_layout() -> None:
    """Equal length is not sufficient: columns in another order are detected."""
    batch = a_batch([block_message(0, axes=("x", "y")), block_message(20, axes=("y", "x")), block_message(40, axes=("x", "y"))])
    found = [stretch.layout.names[1] for stretch in Reader(array_layout).stretches(batch) if stretch.layout]
    assert found == ["seq,time,x,y", "seq,time,y,x", "seq,time,x,y"]


def test_a_mixture_of_layouts_is_read_like_message_by_message() -> None:
    """In any order of layouts, and with broken messages between them, every readable message gives its own numbers."""
    random = np.random.default_rng(2)
    messages, expected = [], []
    for count in range(400):
        rows, axes = int(random.integers(1, 4)), (("x",), ("x", "y"), ("y", "x"))[int(random.integers(3))]
        raw = block_message(count, rows, axes)
        broken = random.random() < 0.1
        messages.append(raw[:-9] if broken else raw)
        expected.append(None if broken else (f"seq,time,{','.join(axes)}", pack(numbered(count, rows, axes)).tolist()))
    batch, reader = a_batch(messages), Reader(array_layout)
    found: list[tuple[str, list[float]] | None] = []
    for stretch in reader.stretches(batch):
        if stretch.layout is None:
            found += [None] * (stretch.last - stretch.first)
        else:
            found += [(stretch.layout.names[1], row) for row in doubles(batch, stretch, 0).tolist()]
    assert found == expected


@pytest.mark.parametrize("parse", [array_layout, joint_layout])
def test_bytes_that_are_no_message_are_refused(parse: object) -> None:
    """A message cut at any byte, or with any byte changed, is readable or Unreadable; nothing else is raised."""
    raw = block_message(0, 2) if parse is array_layout else joint_state(1, np.array([1.0, 2.0]))
    take = array_layout if parse is array_layout else joint_layout
    refused = 0
    for cut in range(len(raw) - 8):
        with pytest.raises(Unreadable):
            take(raw[:cut])
    for place in range(len(raw)):
        for flip in (0x01, 0x80, 0xFF):
            changed = bytearray(raw)
            changed[place] ^= flip
            try:
                layout = take(bytes(changed))
            except Unreadable:
                refused += 1
            else:
                assert isinstance(layout, Layout) and all(o + 8 * c <= len(raw) for o, c in layout.parts)
    assert refused > 10
