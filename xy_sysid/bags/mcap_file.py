"""An MCAP file: its topics, and its messages in log order.

It is read from the start, chunk by chunk, without the index at the end, so that a truncated file gives the messages that it has.
Source: mcap.dev/spec (records Header 1, Footer 2, Schema 3, Channel 4, Message 5, Chunk 6, Statistics 11, DataEnd 15).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.bags.cdr import Bytes
from xy_sysid.bags.checksum import crc32
from xy_sysid.bags.compression import Damaged, decompressor, whole_ones
from xy_sysid.bags.mcap_records import CHANNEL, CHUNK, DATA_END, FOOTER, MAGIC, MESSAGE, SCHEMA
from xy_sysid.bags.stride import Batch, Indices
from xy_sysid.errors import BadRecording
from xy_sysid.jit import compiled

WINDOW = 1 << 20  # bytes read at once if messages are not in chunks
LARGEST = 1 << 31  # bytes; a record with a larger length is damaged
BECOMES = 1 << 28  # bytes; a chunk with a larger decompressed size is damaged, or made to fill the memory
ROWS, BYTES = 4096, 1 << 20  # messages, and bytes, in a batch: it stays in the cache of the processor


@compiled
def messages(data: Bytes, at: int, topics: Indices, rows: Indices) -> tuple[int, int]:
    """Read records from ``at`` while they are messages.

    topics: index of the topic by channel, -1 for unwanted ones; channels after the last are unwanted
    rows:   output, one per wanted message: topic, log time, start, length
    Returns the number of wanted messages, and the offset of the end: another record, an incomplete one, after BYTES, or ``rows`` full.
    """
    found, size, enough = 0, data.shape[0], at + BYTES
    while at + 9 <= size and at < enough and data[at] == 5 and found < rows.shape[0]:
        length = np.int64(0)
        for index in range(8):
            length |= np.int64(data[at + 1 + index]) << (8 * index)
        if length < 22 or length > size - at - 9:
            break
        channel = np.int64(data[at + 9]) | np.int64(data[at + 10]) << 8
        if channel < topics.shape[0] and topics[channel] >= 0:
            time = np.int64(0)
            for index in range(8):
                time |= np.int64(data[at + 15 + index]) << (8 * index)
            rows[found, 0], rows[found, 1], rows[found, 2], rows[found, 3] = topics[channel], time, at + 31, length - 22
            found += 1
        at += 9 + int(length)
    return found, at


def _text(data: bytes | memoryview, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", data, at)
    if at + 4 + length > len(data):
        raise struct.error("text is longer than its record")
    return str(data[at + 4 : at + 4 + length], "utf-8", "replace"), at + 4 + length


class McapFile:
    """One .mcap file, opened for reading; raises BadRecording if it is not one."""

    def __init__(self, path: Path, notes: list[str]) -> None:
        self.path, self.notes = path, notes
        self.schemas: dict[int, str] = {}
        self.channels: dict[int, tuple[str, str]] = {}
        self.handle = os.open(path, os.O_RDONLY)
        self.size = os.fstat(self.handle).st_size
        self.damage = ""
        self.chunks: dict[str, int] = {}
        self._memory = np.empty(0, np.uint8)
        try:
            if os.pread(self.handle, 8, 0) != MAGIC:
                raise BadRecording(path, "not an MCAP file (its first bytes are wrong)", "Give a bag that ros2 or xy-sysid recorded.")
            if not self._summary():
                for _ in self._chunks([]):  # no index at the end: read all chunks for the topics
                    pass
                if not self.damage and os.pread(self.handle, 8, max(0, self.size - 8)) != MAGIC:
                    self.damage = "cut short"
        except BadRecording:
            self.close()
            raise

    @property
    def topics(self) -> list[tuple[str, str]]:
        """(name, type) of each topic."""
        return list(dict.fromkeys(self.channels.values()))

    def close(self) -> None:
        os.close(self.handle)

    def _summary(self) -> bool:
        """Read the topics from the index at the end; False if there is none."""
        tail = os.pread(self.handle, 37, max(0, self.size - 37))
        if len(tail) < 37 or tail[-8:] != MAGIC or tail[0] != FOOTER:
            return False
        (start,) = struct.unpack_from("<Q", tail, 9)
        if not 0 < start < self.size - 37 or self.size - start > LARGEST:
            return False
        data, at = os.pread(self.handle, self.size - 37 - start, start), 0
        while at + 9 <= len(data):
            (length,) = struct.unpack_from("<Q", data, at + 1)
            self._learn(data[at], data[at + 9 : at + 9 + length])
            at += 9 + length
        return bool(self.channels)

    def _learn(self, kind: int, record: bytes) -> None:
        try:
            if kind == SCHEMA:
                self.schemas[struct.unpack_from("<H", record)[0]] = _text(record, 2)[0]
            elif kind == CHANNEL:
                number, schema = struct.unpack_from("<HH", record)
                self.channels[number] = (_text(record, 4)[0], self.schemas.get(schema, ""))
        except struct.error:
            self.damage = "a record is damaged"

    def batches(self, wanted: Sequence[str], unpack: Callable[[bytes, int], bytes] | None) -> Iterator[tuple[Batch, float]]:
        """Messages of these topics in log order, with the fraction of the file that has been read."""
        self.chunks = {}
        yield from whole_ones(self._chunks(wanted), unpack, self.path.name, self.notes)
        for why, count in self.chunks.items():
            self.notes.append(f"{self.path.name}: {why}; {f'{count} chunks are' if count > 1 else 'the chunk is'} left out")
        if self.damage:
            self.notes.append(f"{self.path.name}: {self.damage}; what could be read is read")

    def _chunks(self, wanted: Sequence[str]) -> Iterator[tuple[Batch, float]]:
        at = len(MAGIC)
        while at + 9 <= self.size:
            head = os.pread(self.handle, 9, at)
            kind, length = head[0], int(struct.unpack_from("<Q", head, 1)[0])
            if kind in (FOOTER, DATA_END):
                return
            if kind == 0 or length > LARGEST:
                self.damage = f"damaged at byte {at}"
                return
            if kind == MESSAGE:
                data = np.frombuffer(os.pread(self.handle, max(WINDOW, length + 9), at), np.uint8)
                used = yield from self._walk(data, 0, wanted, at)
                if used == 0:
                    self.damage = "cut short"
                    return
                at += used
                continue
            if kind == CHUNK:
                yield from self._chunk(self._read(length, at + 9), length, wanted, at)
            elif kind in (SCHEMA, CHANNEL):
                self._learn(kind, os.pread(self.handle, length, at + 9))
            at += 9 + length
        if at < self.size or (at > self.size):
            self.damage = self.damage or "cut short"

    def _read(self, length: int, at: int) -> memoryview:
        """Bytes of the file, in memory that the next call reuses: new memory for each chunk takes as long as reading it."""
        length = max(0, min(length, self.size - at))
        if self._memory.size < length:
            self._memory = np.empty(length, np.uint8)
        return self._memory.data[: os.preadv(self.handle, [self._memory[:length].data], at)]

    def _chunk(self, record: memoryview, length: int, wanted: Sequence[str], place: int) -> Iterator[tuple[Batch, float]]:
        try:
            _, _, full, checksum = struct.unpack_from("<QQQI", record)
            method, at = _text(record, 28)
            raw = record[at + 8 :]
            if full > BECOMES:
                raise Damaged(f"it says it becomes {full / 1e9:.3g} GB")
            data = raw if not method else decompressor(method, self.path)(bytes(raw), full)
        except (struct.error, Damaged) as error:
            if len(record) < length:
                self.damage = "cut short"
            else:
                self._lost(f"a chunk is damaged ({error})")
            return
        if len(record) == length and (len(data) != full or (checksum and crc32(data) != checksum)):
            self._lost("the checksum of a chunk does not match")
            return
        array, at = np.frombuffer(data, np.uint8), 0
        while at < len(array):
            used = yield from self._walk(array, at, wanted, place)
            at += used
            if at + 9 > len(array):
                break
            kind, size = data[at], int(struct.unpack_from("<Q", data, at + 1)[0])
            if size > len(array) - at - 9:
                self.damage = "cut short"
                break
            if kind in (SCHEMA, CHANNEL):
                self._learn(kind, bytes(data[at + 9 : at + 9 + size]))
            if used == 0 or kind != MESSAGE:
                at += 9 + size

    def _lost(self, why: str) -> None:
        self.chunks[why] = self.chunks.get(why, 0) + 1

    def _walk(self, data: Bytes, at: int, wanted: Sequence[str], place: int) -> Generator[tuple[Batch, float], None, int]:
        """Yield the messages from ``at`` on; the generator returns their number of bytes."""
        rows = np.empty((ROWS, 4), np.int64)
        start = at
        topics = np.full(max([*self.channels, 0]) + 1, -1, np.int64)
        for number, (name, _) in self.channels.items():
            if name in wanted:
                topics[number] = wanted.index(name)
        before = -1
        while before != at:
            before = at
            found, at = messages(data, at, topics, rows)
            if found:
                kept = rows[:found]
                yield Batch(topic=kept[:, 0], log_time=kept[:, 1], start=kept[:, 2], length=kept[:, 3], buffer=data), min(1.0, place / self.size)
        return at - start
