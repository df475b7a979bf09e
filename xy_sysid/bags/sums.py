"""Checksums for sqlite3 files, which have none of their own: CRC-32 of each topic, in metadata.yaml.

MCAP has its own checksums, and its reader checks them.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from xy_sysid.bags.cdr import Bytes
from xy_sysid.bags.checksum import crc32
from xy_sysid.bags.sqlite_file import SqliteFile, files_of
from xy_sysid.bags.stride import Indices
from xy_sysid.errors import BadRecording
from xy_sysid.jit import compiled

KEY = "xy_sysid_crc32"  # in custom_data of metadata.yaml: {topic: [messages, sum]} as JSON
Checked = Literal["none", "good", "damaged"]
LARGEST = 1 << 22  # bytes; no metadata.yaml of our recorder is as large
BODY = "SELECT topics.name, messages.data FROM messages JOIN topics ON topics.id = messages.topic_id ORDER BY messages.id"


class Sums:
    """Running checksums of the messages of a recording."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[int, int]] = {}

    def add(self, topic: str, data: bytes) -> None:
        """Add the next message of a topic."""
        count, value = self._found.get(topic, (0, 0))
        self._found[topic] = count + 1, crc32(data, value)

    def count(self, topic: str) -> int:
        """Number of messages so far."""
        return self._found.get(topic, (0, 0))[0]

    def sum(self, topic: str) -> int:
        """CRC-32 of the messages so far."""
        return self._found.get(topic, (0, 0))[1]

    def text(self) -> dict[str, str]:
        """The entry for metadata.yaml."""
        return {KEY: json.dumps(self._found)} if self._found else {}


def check_sums(path: Path) -> Checked:
    """ "none" without checksums, "good" if they agree, "damaged" if the file is; raises BadRecording for an intact file with other messages.

    After a killed recorder the last second of messages is not checked, because it is not in the checksums.
    """
    told = _told(path)
    if not told:
        return "none"
    if _agree(path, told):
        return "good"
    found = Sums()  # SQL decides what is wrong
    try:
        for name in _databases(path):
            with closing(sqlite3.connect(f"{name.absolute().as_uri()}?mode=ro", uri=True)) as file:
                for topic, data in file.execute(BODY):
                    if isinstance(data, bytes) and found.count(topic) < told.get(topic, (0, 0))[0]:
                        found.add(topic, data)
    except sqlite3.Error:
        return "damaged"  # the reader reports the damage, and reads the rest
    for topic, (count, value) in told.items():
        if found.count(topic) == count and found.sum(topic) != value:
            if not all(map(_sound, _databases(path))):
                return "damaged"
            problem = f"the messages on {topic} are not those that were recorded (their check sum differs)"
            raise BadRecording(path, problem, f"Take another copy; to read it nevertheless, delete {KEY} in its metadata.yaml.")
    return "good" if all(found.count(topic) == count for topic, (count, _) in told.items()) else "damaged"


def _agree(path: Path, told: dict[str, tuple[int, int]]) -> bool:
    """True if every topic has the recorded number of messages and the recorded sum. Pages are read in compiled code; if False, SQL decides."""
    found, wanted, notes = dict.fromkeys(told, (0, 0)), list(told), list[str]()
    try:
        for name in _databases(path):
            with closing(SqliteFile(name, notes)) as file:
                for batch, _ in file.batches(wanted, None):
                    for index, topic in enumerate(wanted):
                        count, value = found[topic]
                        rows = np.flatnonzero(batch.topic == index)[: max(told[topic][0] - count, 0)]
                        if rows.size:
                            data = _joined(batch.buffer, batch.start[rows], batch.length[rows])
                            found[topic] = count + len(rows), crc32(data.data, value)
    except (BadRecording, sqlite3.Error, OSError):
        return False
    return not notes and found == told


@compiled
def _joined(buffer: Bytes, start: Indices, length: Indices) -> Bytes:
    """The bytes of some messages, one after the other."""
    out, at = np.empty(np.sum(length), np.uint8), 0
    for row in range(start.shape[0]):
        source, target = buffer[start[row] : start[row] + length[row]], out[at : at + length[row]]
        for index in range(length[row]):
            target[index] = source[index]
        at += length[row]
    return out


def _databases(path: Path) -> list[Path]:
    """The databases of a bag, without pipes and devices of such a name."""
    found = []
    for file in sorted(path.glob("*.db3")):
        with suppress(BadRecording, OSError):
            found.append(files_of(file)[0])
    return found


def _sound(name: Path) -> bool:
    """True if the file is a complete, valid database, with any content; a truncated or damaged one may give wrong messages."""
    try:
        with closing(sqlite3.connect(f"{name.absolute().as_uri()}?mode=ro", uri=True)) as file:
            (pages,), (size,) = file.execute("PRAGMA page_count").fetchone(), file.execute("PRAGMA page_size").fetchone()
            return bool(name.stat().st_size >= pages * size and file.execute("PRAGMA quick_check(1)").fetchone() == ("ok",))
    except sqlite3.Error:
        return False


def _told(path: Path) -> dict[str, tuple[int, int]]:
    """(number of messages, sum) of each topic; empty without checksums of our recorder."""
    file = path / "metadata.yaml"
    try:
        if not file.is_file() or file.stat().st_size > LARGEST:
            return {}
        document: Any = json.loads(file.read_text("utf-8"))  # that of our recorder is JSON
        told = json.loads(document["rosbag2_bagfile_information"]["custom_data"][KEY])
        return {str(topic): (int(count), int(value)) for topic, (count, value) in told.items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}
