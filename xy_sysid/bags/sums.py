"""Check sums of what is written to sqlite3, which has none of its own: CRC-32 of each topic, in metadata.yaml.

MCAP has sums of its own, and its reader checks them.
"""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Literal
from zlib import crc32

from xy_sysid.bags.sqlite_file import files_of
from xy_sysid.errors import BadRecording

KEY = "xy_sysid_crc32"  # in custom_data of metadata.yaml: {topic: [messages, sum]} as JSON
Checked = Literal["none", "good", "damaged"]
LARGEST = 1 << 22  # bytes of a metadata.yaml of our recorder, by far
BODY = "SELECT topics.name, messages.data FROM messages JOIN topics ON topics.id = messages.topic_id ORDER BY messages.id"


class Sums:
    """Adds up the messages of a recording as they are written."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[int, int]] = {}

    def add(self, topic: str, data: bytes) -> None:
        """The next message of a topic."""
        count, value = self._found.get(topic, (0, 0))
        self._found[topic] = count + 1, crc32(data, value)

    def count(self, topic: str) -> int:
        """Messages so far."""
        return self._found.get(topic, (0, 0))[0]

    def sum(self, topic: str) -> int:
        """What they add up to."""
        return self._found.get(topic, (0, 0))[1]

    def text(self) -> dict[str, str]:
        """What to keep in metadata.yaml."""
        return {KEY: json.dumps(self._found)} if self._found else {}


def check_sums(path: Path) -> Checked:
    """Whether a bag has sums, and whether its file is too damaged to be added up; raises BadRecording where its messages do not add up to them.

    A recorder that was killed has written a second of messages more than it has summed up: those are not checked.
    """
    told = _told(path)
    if not told:
        return "none"
    found = Sums()
    try:
        for name in _databases(path):
            with closing(sqlite3.connect(f"{name.absolute().as_uri()}?mode=ro", uri=True)) as file:
                for topic, data in file.execute(BODY):
                    if isinstance(data, bytes) and found.count(topic) < told.get(topic, (0, 0))[0]:
                        found.add(topic, data)
    except sqlite3.Error:
        return "damaged"  # the reader says with what, and reads the rest
    for topic, (count, value) in told.items():
        if found.count(topic) == count and found.sum(topic) != value:
            if not all(map(_sound, _databases(path))):
                return "damaged"
            problem = f"the messages on {topic} are not those that were recorded (their check sum differs)"
            raise BadRecording(path, problem, f"Take another copy; to read it nevertheless, delete {KEY} in its metadata.yaml.")
    return "good" if all(found.count(topic) == count for topic, (count, _) in told.items()) else "damaged"


def _databases(path: Path) -> list[Path]:
    """The databases of a bag; a pipe or a device that is called like one is none."""
    found = []
    for file in sorted(path.glob("*.db3")):
        with suppress(BadRecording, OSError):
            found.append(files_of(file)[0])
    return found


def _sound(name: Path) -> bool:
    """Whether a database is one, whatever stands in it: a file that was cut or torn may give anything."""
    try:
        with closing(sqlite3.connect(f"{name.absolute().as_uri()}?mode=ro", uri=True)) as file:
            (pages,), (size,) = file.execute("PRAGMA page_count").fetchone(), file.execute("PRAGMA page_size").fetchone()
            return bool(name.stat().st_size >= pages * size and file.execute("PRAGMA quick_check(1)").fetchone() == ("ok",))
    except sqlite3.Error:
        return False


def _told(path: Path) -> dict[str, tuple[int, int]]:
    """(messages, sum) of each topic; nothing where our recorder has written no sums."""
    file = path / "metadata.yaml"
    try:
        if not file.is_file() or file.stat().st_size > LARGEST:
            return {}
        document: Any = json.loads(file.read_text("utf-8"))  # ours is JSON
        told = json.loads(document["rosbag2_bagfile_information"]["custom_data"][KEY])
        return {str(topic): (int(count), int(value)) for topic, (count, value) in told.items()}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}
