"""Writes one MCAP file that is valid after every flush: each flush writes the end mark, and overwrites the previous one.

Source: mcap.dev/spec. The index at the end is written on close; without it a reader reads the whole file.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path

from xy_sysid.bags.checksum import crc32
from xy_sysid.bags.mcap_records import CHANNEL, CHUNK, DATA_END, FOOTER, MAGIC, MESSAGE, SCHEMA
from xy_sysid.errors import BadRecording

HEADER, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, METADATA, METADATA_INDEX = 1, 7, 8, 11, 12, 13


def record(kind: int, content: bytes) -> bytes:
    """One record: opcode, length, content."""
    return struct.pack("<BQ", kind, len(content)) + content


def text(value: str) -> bytes:
    """A string: length, UTF-8."""
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


END = record(DATA_END, struct.pack("<I", 0))


class McapWriter:
    """One .mcap file in chunks without compression."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = path.open("xb", buffering=0)
        self.at = 0
        self.schemas: dict[str, bytes] = {}
        self.channels: list[bytes] = []
        self.counts: dict[int, int] = {}
        self.chunk: list[tuple[int, int, bytes]] = []
        self.index: list[bytes] = []
        self.first, self.last = 2**63, 0
        self._put(MAGIC + record(HEADER, text("ros2") + text("xy_sysid")))

    def add(self, number: int, topic: str, kind: str, text_of_type: str, digest: str) -> None:
        self.flush()
        new = b""
        if kind not in self.schemas:
            content = struct.pack("<H", len(self.schemas) + 1) + text(kind) + text("ros2msg") + text(text_of_type)
            new = self.schemas[kind] = record(SCHEMA, content)
        schema = list(self.schemas).index(kind) + 1
        extra = text("offered_qos_profiles") + text("[]") + text("topic_type_hash") + text(digest)
        self.channels.append(record(CHANNEL, struct.pack("<HH", number, schema) + text(topic) + text("cdr") + struct.pack("<I", len(extra)) + extra))
        self.counts[number] = 0
        self._put(new + self.channels[-1])

    def write(self, number: int, log_time: int, data: bytes) -> None:
        self.chunk.append((number, log_time, data))

    def flush(self) -> None:
        """Write the waiting messages as one chunk, with its index."""
        if not self.chunk:
            return
        waiting, self.chunk = self.chunk, []
        parts: list[bytes] = []
        places: dict[int, list[bytes]] = {}
        offset = 0
        for number, log_time, data in waiting:
            content = record(MESSAGE, struct.pack("<HIQQ", number, self.counts[number] & 0xFFFFFFFF, log_time, log_time) + data)
            places.setdefault(number, []).append(struct.pack("<QQ", log_time, offset))
            parts.append(content)
            offset += len(content)
            self.counts[number] += 1
        body = b"".join(parts)
        times = [log_time for _, log_time, _ in waiting]
        first, last = min(times), max(times)
        self.first, self.last = min(self.first, first), max(self.last, last)
        chunk = record(CHUNK, struct.pack("<QQQI", first, last, len(body), crc32(body)) + text("") + struct.pack("<Q", len(body)) + body)
        indices, offsets, here = b"", b"", self.at + len(chunk)
        for number, entries in places.items():
            offsets += struct.pack("<HQ", number, here + len(indices))
            joined = b"".join(entries)
            indices += record(MESSAGE_INDEX, struct.pack("<HI", number, len(joined)) + joined)
        self.index.append(
            record(
                CHUNK_INDEX,
                struct.pack("<QQQQI", first, last, self.at, len(chunk), len(offsets))
                + offsets
                + struct.pack("<Q", len(indices))
                + text("")
                + struct.pack("<QQ", len(body), len(body)),
            )
        )
        self._put(chunk + indices)
        self._sync()

    def close(self, metadata: str) -> None:
        self.flush()
        kept = record(METADATA, text("rosbag2") + (lambda pair: struct.pack("<I", len(pair)) + pair)(text("serialized_metadata") + text(metadata)))
        found = record(METADATA_INDEX, struct.pack("<QQ", self.at, len(kept)) + text("rosbag2"))
        start = self.at + len(kept) + len(END)
        counts = b"".join(struct.pack("<HQ", number, count) for number, count in self.counts.items())
        first = self.first if self.index else 0
        shape = (sum(self.counts.values()), len(self.schemas), len(self.channels), 0, 1, len(self.index), first, self.last)
        statistics = record(STATISTICS, struct.pack("<QHIIIIQQ", *shape) + struct.pack("<I", len(counts)) + counts)
        summary = b"".join([*self.schemas.values(), *self.channels, *self.index, found, statistics])
        self._write(kept + END + summary + record(FOOTER, struct.pack("<QQI", start, 0, 0)) + MAGIC)
        self.file.close()

    def _put(self, data: bytes) -> None:
        """Append before the end mark."""
        self._write(data + END + record(FOOTER, struct.pack("<QQI", 0, 0, 0)) + MAGIC)
        self.at += len(data)

    def _sync(self) -> None:
        """Wait for the disk: flushed data survive a power failure, not only the end of the recorder."""
        try:
            os.fdatasync(self.file.fileno())
        except OSError as error:
            raise BadRecording(self.path, f"cannot be written ({error.strerror})", "Make room on the disk, or record elsewhere.") from None

    def _write(self, data: bytes) -> None:
        try:
            self.file.seek(self.at)
            rest = memoryview(data)
            while rest:
                rest = rest[self.file.write(rest) or 0 :]
        except OSError as error:
            raise BadRecording(self.path, f"cannot be written ({error.strerror})", "Make room on the disk, or record elsewhere.") from None
