"""Writes one rosbag2 sqlite3 file, schema 4, with a commit per flush."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from xy_sysid.errors import BadRecording

PAGE = 1 << 15  # bytes; with sqlite's default of 4096, blocks of 20 rows leave a tenth empty, and reading takes longer
SCHEMA = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
  offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
  encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema(schema_version, ros_distro) VALUES (4, 'jazzy');
"""


class SqliteWriter:
    """One .db3 file. A journal exists only during a commit; between commits the file alone is a complete bag."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.touch(exist_ok=False)
        self.rows: list[tuple[int, int, bytes]] = []
        self.database = sqlite3.connect(path, check_same_thread=False)
        self.database.execute(f"PRAGMA page_size={PAGE}")
        self.database.execute("PRAGMA synchronous=FULL")
        self.database.executescript(SCHEMA)
        self.types: set[str] = set()

    def add(self, number: int, topic: str, kind: str, text: str, digest: str) -> None:
        if kind not in self.types:
            self.types.add(kind)
            self.database.execute(
                "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, type_description_hash) VALUES(?,'ros2msg',?,?)",
                (kind, text, digest),
            )
        self.database.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '[]', ?)", (number, topic, kind, digest))

    def write(self, number: int, log_time: int, data: bytes) -> None:
        self.rows.append((number, log_time, data))

    def flush(self) -> None:
        rows, self.rows = self.rows, []
        try:
            self.database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", rows)
            self.database.commit()
        except sqlite3.OperationalError as error:
            raise BadRecording(self.path, f"cannot be written ({error})", "Make room on the disk, or record elsewhere.") from None

    def close(self, metadata: str) -> None:
        self.flush()
        self.database.execute("INSERT INTO metadata(metadata_version, metadata) VALUES(9, ?)", (metadata,))
        self.database.commit()
        self.database.close()
