"""The messages of a rosbag2 sqlite3 file, read directly from its pages.

SQL returns one Python tuple per row; reading the table's B-tree in compiled code gives the same bytes ten times
faster, and also the readable part of a damaged file. Source: sqlite.org/fileformat2.html, sections 1.5 and 1.6.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from xy_sysid.bags.cdr import Bytes
from xy_sysid.bags.stride import Indices
from xy_sysid.jit import compiled, inlined

INTERIOR, LEAF = 5, 13
SPAN = 1 << 20  # bytes read at once: stays in the cache of the processor
WIDTHS = np.array([0, 1, 2, 3, 4, 6, 8, 0, 0, 0])  # bytes of an integer column, by serial type
GROUP = 4096  # leaf pages listed at once
ROWS = 4096  # messages found at once; more if they are small
DEEPEST = 20  # levels; a deeper B-tree is damaged
WIDEST = 1 << 26  # bytes; a leaf with overflow pages further away is read by SQL


@dataclass(frozen=True, slots=True)
class PageFile:
    """An open database file. size: bytes of a page; usable: without the reserved tail; pages: whole pages in the file."""

    handle: int
    size: int
    usable: int
    pages: int


class Span(NamedTuple):
    """Pages ``first``, ``first + 1``, ... at the beginning of a buffer, up to byte ``filled``; size, usable: as in ``PageFile``."""

    first: int
    filled: int
    size: int
    usable: int


class Cell(NamedTuple):
    """One message. body, length: where its data begin in the buffer, and their bytes; here: how many of them are on the leaf page."""

    row_id: int
    topic: int
    time: int
    body: int
    length: int
    here: int


DAMAGED = Cell(row_id=0, topic=-1, time=0, body=0, length=-1, here=-1)


@dataclass(frozen=True, slots=True)
class Cells:
    """The rows found in one span of pages: see ``leaf_cells`` for the columns of ``rows``."""

    rows: Indices
    buffer: Bytes
    damaged: int
    position: float


def open_pages(handle: int) -> PageFile:
    """Sizes from the file header."""
    header = os.pread(handle, 100, 0)
    size = int.from_bytes(header[16:18], "big")
    size = 65536 if size == 1 else size
    return PageFile(handle, size, size - header[20], os.fstat(handle).st_size // size)


def _children(file: PageFile, number: int) -> NDArray[np.int64] | None:
    """Pages below an interior page, in row order; None for a leaf; empty for a page that is neither."""
    page = os.pread(file.handle, file.size, (number - 1) * file.size)
    if len(page) < file.size:
        return np.empty(0, np.int64)
    if page[0] == LEAF:
        return None
    count = int.from_bytes(page[3:5], "big")
    if page[0] != INTERIOR or 12 + 2 * count > file.size:
        return np.empty(0, np.int64)
    pointers = np.frombuffer(page, ">u2", count, 12).astype(np.int64)
    pointers = pointers[pointers + 4 <= file.size]
    left = np.frombuffer(page, np.uint8)[pointers[:, None] + np.arange(4)].astype(np.int64) @ np.array([1 << 24, 1 << 16, 1 << 8, 1])
    return np.append(left, int.from_bytes(page[8:12], "big"))


def leaves(file: PageFile, root: int) -> Iterator[NDArray[np.int64]]:
    """Numbers of the leaf pages in row order, many at a time; a number outside the file means a lost page."""
    waiting, ready, seen, depth = [(root, 0)], [np.empty(0, np.int64)], 0, DEEPEST
    while waiting and seen <= file.pages:
        number, level = waiting.pop()
        below = _children(file, number) if 1 <= number <= file.pages and level < depth else np.empty(0, np.int64)
        seen += 1
        if below is None:
            depth = level  # all leaves of a B-tree are at the same level
            below = np.array([number])
        elif below.size and level + 1 < depth:
            inside = below[(below >= 1) & (below <= file.pages)]
            if depth == DEEPEST and inside.size and _children(file, int(inside[0])) is None:
                depth = level + 1
        if below.size and level + 1 < depth:
            waiting += [(child, level + 1) for child in below[::-1].tolist()]
            continue
        ready.append(below if below.size else np.zeros(1, np.int64))
        if sum(map(len, ready)) >= GROUP:
            yield np.concatenate(ready)
            ready = []
    if ready:
        yield np.concatenate(ready)


@compiled
def varint(data: Bytes, at: int) -> tuple[int, int]:
    """Value, and the offset after it; ``data`` must have 9 bytes from ``at``."""
    value = np.int64(0)
    for index in range(8):
        byte = np.int64(data[at + index])
        value = (value << 7) | (byte & 127)
        if byte < 128:
            return int(value), at + index + 1
    return int((value << 8) | np.int64(data[at + 8])), at + 9


@compiled
def integer(data: Bytes, at: int, kind: int) -> int:
    """Value of an integer column of serial type ``kind``."""
    if kind == 0 or kind == 8:
        return 0
    if kind == 9:
        return 1
    value = np.int64(np.int8(data[at]))
    for index in range(1, WIDTHS[kind]):
        value = (value << 8) | np.int64(data[at + index])
    return int(value)


@inlined
def big_endian(data: Bytes, at: int, width: int) -> int:
    """Value of an unsigned number of ``width`` bytes."""
    value = np.int64(0)
    for index in range(width):
        value = (value << 8) | np.int64(data[at + index])
    return int(value)


@inlined
def _on_leaf(payload: int, usable: int) -> int:
    """How many bytes of a row are on its leaf page; the others are on overflow pages."""
    if payload <= usable - 35:
        return payload
    least = (usable - 12) * 32 // 255 - 23
    local = least + (payload - least) % (usable - 4)
    return local if local <= usable - 35 else least


@inlined
def _cell(buffer: Bytes, at: int, end: int, usable: int) -> Cell:
    """The message whose row begins at ``at``, on a page up to ``end``; DAMAGED if it is no message.

    A damaged row may extend beyond its page, but never beyond the free space behind the pages.
    """
    if at >= end:
        return DAMAGED
    payload, at = varint(buffer, at)
    row_id, record = varint(buffer, at)
    local = _on_leaf(payload, usable)
    if payload < 5 or record + local + (4 if local < payload else 0) > end:
        return DAMAGED
    header, at = varint(buffer, record)
    id_kind, topic_kind, time_kind = buffer[at], buffer[at + 1], buffer[at + 2]
    data_kind, at = varint(buffer, at + 3)
    if id_kind != 0 or topic_kind > 9 or time_kind > 9 or data_kind < 12 or data_kind % 2 or at != record + header:
        return DAMAGED
    time = at + int(WIDTHS[topic_kind])
    body = time + int(WIDTHS[time_kind])
    length = (data_kind - 12) // 2
    if body - record + length != payload or body - record > local:
        return DAMAGED
    return Cell(row_id, integer(buffer, at, topic_kind), integer(buffer, time, time_kind), body, length, record + local - body)


@compiled
def _gathered(buffer: Bytes, span: Span, cell: Cell, spill: int) -> bool:
    """Copy the data of a message from its leaf and overflow pages to ``spill``; False if one of the pages is not in the buffer."""
    buffer[spill : spill + cell.here] = buffer[cell.body : cell.body + cell.here]
    done, link = cell.here, cell.body + cell.here
    while done < cell.length:
        link = (big_endian(buffer, link, 4) - span.first) * span.size
        if link < 0 or link + span.size > span.filled:
            return False
        part = min(span.usable - 4, cell.length - done)
        buffer[spill + done : spill + done + part] = buffer[link + 4 : link + 4 + part]
        done += part
    return True


@compiled
def leaf_cells(buffer: Bytes, span: Span, numbers: Indices, topics: Indices, rows: Indices) -> tuple[int, int, int]:
    """Find the messages (id, topic_id, timestamp, data) of some leaf pages.

    buffer:  the pages of ``span``, then free space for data of overflow pages
    numbers: the leaf pages to read
    topics:  index of the topic by topic id, -1 for unwanted ones; ids after the last are unwanted
    rows:    output, one per wanted message: row id, topic, log time, start in buffer (-1: its pages are not in the buffer), length
    Returns the number of messages (-1: a larger ``rows`` or buffer is needed), of damaged pages, and the end of the overflow data.
    """
    found, damaged, spill = 0, 0, span.filled
    for number in numbers:
        base = (number - span.first) * span.size
        if base < 0 or base + span.size > span.filled or buffer[base] != LEAF or 8 + 2 * big_endian(buffer, base + 3, 2) > span.usable:
            damaged += 1
            continue
        broken = False
        for pointer in range(base + 8, base + 8 + 2 * big_endian(buffer, base + 3, 2), 2):
            cell = _cell(buffer, base + big_endian(buffer, pointer, 2), base + span.usable, span.usable)
            if cell.length < 0:
                broken = True
            if cell.topic < 0 or cell.topic >= topics.shape[0] or topics[cell.topic] < 0:
                continue
            start, end = cell.body, spill
            if cell.here < cell.length:
                start, end = spill, spill + cell.length
            if found >= rows.shape[0] or end > buffer.shape[0]:
                return -1, damaged, end
            if end > spill and not _gathered(buffer, span, cell, spill):
                start, end = -1, spill
            rows[found, 0], rows[found, 1], rows[found, 2] = cell.row_id, topics[cell.topic], cell.time
            rows[found, 3], rows[found, 4] = start, cell.length
            found, spill = found + 1, end
        damaged += broken
    return found, damaged, spill


def scan(file: PageFile, root: int, topics: Indices) -> Iterator[Cells]:
    """The messages of ``topics`` (see ``leaf_cells``), span by span of pages; the buffer is reused."""
    buffer = np.empty(0, np.uint8)
    rows = np.empty((ROWS, 5), np.int64)
    wide, widest = max(1, SPAN // file.size), max(1, WIDEST // file.size)
    before = -wide - 1
    for group in leaves(file, root):
        numbers = group[(group >= 1) & (group <= file.pages)]
        if len(numbers) < len(group):
            yield Cells(rows[:0], buffer, len(group) - len(numbers), 0.0)
        at, total = 0, len(numbers)
        while at < total:
            low = before + 1 if 0 <= numbers[at] - before <= wide else int(numbers[at])
            near = numbers[at : at + wide]
            outside = np.flatnonzero((near < low) | (near >= low + wide))
            end = max(at + 1, at + (int(outside[0]) if outside.size else len(near)))
            top = int(numbers[at:end].max())
            following = int(numbers[end]) if end < total else min(top + wide, file.pages + 1)
            high = following if top < following <= top + widest else top + 1
            span = (high - low) * file.size
            if buffer.size < 2 * span:
                buffer = np.empty(2 * max(span, SPAN), np.uint8)
            filled = os.preadv(file.handle, [buffer[:span].data], (low - 1) * file.size)
            while True:
                found, damaged, spill = leaf_cells(buffer, Span(low, filled, file.size, file.usable), numbers[at:end], topics, rows)
                if found >= 0:
                    break
                if spill > buffer.size:
                    buffer = np.concatenate((buffer, np.empty(spill, np.uint8)))
                else:
                    rows = np.empty((2 * len(rows), 5), np.int64)
            yield Cells(rows[:found], buffer, damaged, min(1.0, top / file.pages))
            before, at = top, end
