"""The messages of a rosbag2 sqlite3 file, taken straight from its pages.

SQL hands over one Python tuple per row; walking the table's B-tree in compiled code gives the same bytes ten times
faster, and what can be read of a damaged file. Source: sqlite.org/fileformat2.html, sections 1.5 and 1.6.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.bags.cdr import Bytes
from xy_sysid.bags.stride import Indices
from xy_sysid.compiled import compiled

INTERIOR, LEAF = 5, 13
SPAN = 256  # pages read at once: stays in the cache of the processor
WIDTHS = np.array([0, 1, 2, 3, 4, 6, 8, 0, 0, 0])  # bytes of an integer column, by serial type
WIDEST = 16_384  # pages; one leaf with longer chains of overflow than this is read by SQL


@dataclass(frozen=True, slots=True)
class PageFile:
    """An open database file. size: bytes of a page; usable: without the reserved tail; pages: whole pages in the file."""

    handle: int
    size: int
    usable: int
    pages: int


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


def leaves(file: PageFile, root: int) -> tuple[NDArray[np.int64], int]:
    """Numbers of the leaf pages in row order, and how many pages of the index above them are damaged or missing."""
    level, damaged = np.array([root], np.int64), 0
    while True:
        below: list[NDArray[np.int64]] = []
        for number in level.tolist():
            page = os.pread(file.handle, file.size, (number - 1) * file.size) if number <= file.pages else b""
            if len(page) == file.size and page[0] == LEAF:
                return level, damaged
            count = int.from_bytes(page[3:5], "big") if len(page) == file.size else 0
            if len(page) < file.size or page[0] != INTERIOR or 12 + 2 * count > file.size:
                damaged += 1
                continue
            raw = np.frombuffer(page, np.uint8)
            pointers = np.frombuffer(page, ">u2", count, 12).astype(np.int64)
            pointers = pointers[pointers + 4 <= file.size]
            children = raw[pointers[:, None] + np.arange(4)].astype(np.int64) @ np.array([1 << 24, 1 << 16, 1 << 8, 1])
            below.append(np.append(children, int.from_bytes(page[8:12], "big")))
        if not below:
            return np.empty(0, np.int64), damaged
        level = np.concatenate(below)


@compiled
def varint(data: Bytes, at: int) -> tuple[np.int64, int]:
    """Value and the offset after it; at most 9 bytes from ``at`` must be there."""
    value = np.int64(0)
    for index in range(8):
        byte = np.int64(data[at + index])
        value = (value << 7) | (byte & 127)
        if byte < 128:
            return value, at + index + 1
    return (value << 8) | np.int64(data[at + 8]), at + 9


@compiled
def integer(data: Bytes, at: int, kind: int) -> np.int64:
    """Value of an integer column of serial type ``kind``."""
    if kind == 0 or kind == 8:
        return np.int64(0)
    if kind == 9:
        return np.int64(1)
    value = np.int64(np.int8(data[at]))
    for index in range(1, WIDTHS[kind]):
        value = (value << 8) | np.int64(data[at + index])
    return value


@compiled
def leaf_cells(buffer: Bytes, first: int, filled: int, numbers: Indices, size: int, usable: int, spill: int, rows: Indices) -> tuple[int, int, int]:
    """Find the messages (id, topic_id, timestamp, data) of some leaf pages.

    buffer:  pages ``first``, ``first + 1``, ... up to byte ``filled``, then free space from ``spill`` for chained data
    numbers: the leaf pages to look at
    rows:    out, one per message: row id, topic id, log time, start in buffer (-1: not within reach), length
    Returns how many messages, how many damaged pages, and the end of the chained data (over the buffer: too small).
    """
    found, damaged = 0, 0
    for number in numbers:
        base = (number - first) * size
        if base < 0 or base + size > filled or buffer[base] != 13:
            damaged += 1
            continue
        count = np.int64(buffer[base + 3]) << 8 | np.int64(buffer[base + 4])
        if 8 + 2 * count > usable:
            damaged += 1
            continue
        end = base + usable
        broken = False
        for cell in range(count):
            pointer = base + 8 + 2 * cell
            at = base + (np.int64(buffer[pointer]) << 8 | np.int64(buffer[pointer + 1]))
            if at >= end:
                broken = True
                continue
            # A damaged cell may lead over the end of its page, but never over the free space behind the pages.
            payload, at = varint(buffer, at)
            row_id, at = varint(buffer, at)
            local = payload
            if payload > usable - 35:
                least = (usable - 12) * 32 // 255 - 23
                local = np.int64(least + (payload - least) % (usable - 4))
                if local > usable - 35:
                    local = np.int64(least)
            if payload < 5 or at + local + (4 if local < payload else 0) > end:
                broken = True
                continue
            record = at
            header, at = varint(buffer, at)
            id_kind, topic_kind, time_kind = buffer[at], buffer[at + 1], buffer[at + 2]
            data_kind, at = varint(buffer, at + 3)
            if id_kind != 0 or topic_kind > 9 or time_kind > 9 or data_kind < 12 or data_kind % 2 or at != record + header:
                broken = True
                continue
            topic = integer(buffer, at, topic_kind)
            at += WIDTHS[topic_kind]
            time = integer(buffer, at, time_kind)
            body = at + WIDTHS[time_kind]
            length = (data_kind - 12) // 2
            if body - record + length != payload or body - record > local:
                broken = True
                continue
            if found >= rows.shape[0]:
                return -1, damaged, spill
            rows[found, 0], rows[found, 1], rows[found, 2], rows[found, 4] = row_id, topic, time, length
            rows[found, 3] = body
            if local < payload:
                here = record + local - body
                if spill + length > buffer.shape[0]:
                    return -1, damaged, spill + int(length)
                buffer[spill : spill + here] = buffer[body : body + here]
                done, link = here, np.int64(record + local)
                reachable = True
                while done < length:
                    chained = (
                        np.int64(buffer[link]) << 24 | np.int64(buffer[link + 1]) << 16 | np.int64(buffer[link + 2]) << 8 | np.int64(buffer[link + 3])
                    )
                    link = (chained - first) * size
                    if link < 0 or link + size > filled:
                        reachable = False
                        break
                    part = min(usable - 4, length - done)
                    buffer[spill + done : spill + done + part] = buffer[link + 4 : link + 4 + part]
                    done += part
                rows[found, 3] = spill if reachable else -1
                if reachable:
                    spill += int(length)
            found += 1
        if broken:
            damaged += 1
    return found, damaged, spill


def scan(file: PageFile, numbers: NDArray[np.int64]) -> Iterator[Cells]:
    """The messages of these leaf pages, span by span; the buffer is reused."""
    buffer = np.empty(0, np.uint8)
    rows = np.empty((SPAN * 16, 5), np.int64)
    at, total = 0, len(numbers)
    before = int(numbers[0]) - 1 if total else 0
    while at < total:
        low = before + 1 if 0 <= numbers[at] - before <= SPAN else int(numbers[at])
        near = numbers[at : at + SPAN]
        outside = np.flatnonzero((near < low) | (near >= low + SPAN))
        end = max(at + 1, at + (int(outside[0]) if outside.size else len(near)))
        following = int(numbers[end]) if end < total else file.pages + 1
        top = int(numbers[at:end].max())
        high = following if top < following <= top + WIDEST else top + 1
        span = (high - low) * file.size
        if buffer.size < 2 * span:
            buffer = np.empty(2 * max(span, SPAN * file.size), np.uint8)
        filled = max(0, os.preadv(file.handle, [buffer[:span].data], (low - 1) * file.size))
        while True:
            found, damaged, spill = leaf_cells(buffer, low, filled, numbers[at:end], file.size, file.usable, filled, rows)
            if found >= 0:
                break
            if spill > buffer.size:
                buffer = np.concatenate((buffer, np.empty(spill, np.uint8)))
            else:
                rows = np.empty((2 * len(rows), 5), np.int64)
        yield Cells(rows[:found], buffer, damaged, end / total)
        before, at = top, end
