"""A rosbag2 sqlite3 file: its topics, and its messages in log order."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.bags import pages
from xy_sysid.bags.compression import whole_ones
from xy_sysid.bags.opening import regular_file
from xy_sysid.bags.stride import Batch, Indices
from xy_sysid.errors import BadRecording

COLUMNS = ["id", "topic_id", "timestamp", "data"]
BESIDE = ("-journal", "-wal", "-shm")  # endings of the files that sqlite keeps next to a database
ROWS = 1024  # rows fetched at once by SQL
TOPICS = 1 << 16  # topic ids from 0 up to here are looked up in a table; others are read by SQL


def files_of(path: Path) -> list[Path]:
    """The files of a database that exist: itself, and those of ``BESIDE``. Raises BadRecording if one is not a regular file."""
    found = [path, *(beside for ending in BESIDE if (beside := path.with_name(path.name + ending)).exists())]
    for file in found:
        regular_file(file)
    return found


def _unsaved(path: Path) -> list[Path]:
    """Files next to the database with changes that are not in it yet."""
    found = []
    for ending in BESIDE[:2]:
        beside = path.with_name(path.name + ending)
        with contextlib.suppress(OSError):
            if beside.stat().st_size > 0:
                found.append(beside)
    return found


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    """Open a database, also a truncated one (``writable_schema`` disables sqlite's check of the length)."""
    connection = sqlite3.connect(f"file:{_quoted(path)}?{mode}", uri=True)
    connection.execute("PRAGMA writable_schema=ON")
    connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    return connection


def _quoted(path: Path) -> str:
    return str(path.resolve()).replace("%", "%25").replace("?", "%3f").replace("#", "%23")


class SqliteFile:
    """One .db3 file, opened for reading; raises BadRecording if it is not one."""

    def __init__(self, path: Path, notes: list[str]) -> None:
        self.path, self.notes = path, notes
        self._closed = contextlib.ExitStack()
        files_of(path)
        self.database = self._open()
        self._closed.callback(self.database.close)
        try:
            tables = {name for (name,) in self.database.execute("SELECT name FROM sqlite_master WHERE type='table'")}
            if not {"topics", "messages"} <= tables:
                raise BadRecording(path, "an sqlite3 file without the tables of a rosbag2", "Give a bag that ros2 or xy-sysid recorded.")
            self.ids = [(int(i), str(name), str(kind)) for i, name, kind in self.database.execute("SELECT id, name, type FROM topics ORDER BY id")]
        except (sqlite3.DatabaseError, TypeError, ValueError) as error:
            self.close()
            raise BadRecording(path, f"the list of topics is damaged ({error})", "Take another copy of the bag.") from None
        except BadRecording:
            self.close()
            raise

    def _open(self) -> sqlite3.Connection:
        # The journal of a killed process is rolled back first, which needs write access; otherwise the file is read unchanged.
        ways = ["mode=rw", "mode=ro", "immutable=1"] if _unsaved(self.path) else ["mode=ro", "immutable=1"]
        problem = ""
        for way in ways:
            try:
                return _connect(self.path, way)
            except sqlite3.DatabaseError as error:
                problem = str(error)
        raise BadRecording(self.path, f"not readable as an sqlite3 bag ({problem})", "Take another copy of the bag.")

    @property
    def topics(self) -> list[tuple[str, str]]:
        """(name, type) of each topic."""
        return [(name, kind) for _, name, kind in self.ids]

    def close(self) -> None:
        self._closed.close()

    def batches(self, wanted: Sequence[str], unpack: Callable[[bytes, int], bytes] | None) -> Iterator[tuple[Batch, float]]:
        """Messages of these topics in log order, with the fraction of the file that has been read."""
        lookup = {identity: wanted.index(name) for identity, name, _ in self.ids if name in wanted}
        info = [str(row[1]) for row in self.database.execute("PRAGMA table_info(messages)")]
        root = self.database.execute("SELECT rootpage FROM sqlite_master WHERE name='messages' AND type='table'").fetchone()
        plain = info == COLUMNS and root is not None and not _unsaved(self.path)
        plain = plain and all(0 <= identity < TOPICS for identity in lookup)
        found = self._walk(int(root[0]), lookup) if plain else self._rows(lookup)
        yield from whole_ones(found, unpack, self.path.name, self.notes)

    def _walk(self, root: int, lookup: dict[int, int]) -> Iterator[tuple[Batch, float]]:
        handle = os.open(self.path, os.O_RDONLY)
        try:
            file = pages.open_pages(handle)
            damaged = 0
            topics = np.full(max([*lookup, 0]) + 1, -1, np.int64)
            for identity, index in lookup.items():
                topics[identity] = index
            for cells in pages.scan(file, root, topics):
                damaged += cells.damaged
                rows = cells.rows
                if not len(rows):
                    continue
                if rows[:, 3].min() < 0:
                    yield self._by_id(rows[:, 0], lookup), cells.position
                    continue
                yield Batch(topic=rows[:, 1], log_time=rows[:, 2], start=rows[:, 3], length=rows[:, 4], buffer=cells.buffer), cells.position
        finally:
            os.close(handle)
        if damaged:
            self.notes.append(f"{self.path.name}: {damaged} of its {file.pages} pages are damaged or missing; what they held is left out")

    def _by_id(self, ids: Indices, lookup: dict[int, int]) -> Batch:
        """Messages whose overflow pages are far apart, read by SQL."""
        found = []
        for identity in ids.tolist():
            try:
                found += self.database.execute("SELECT topic_id, timestamp, data FROM messages WHERE id=?", (identity,)).fetchall()
            except sqlite3.DatabaseError:
                note = f"{self.path.name}: some messages are damaged or missing; they are left out"
                if note not in self.notes:
                    self.notes.append(note)
        return _batch(found, lookup)

    def _rows(self, lookup: dict[int, int]) -> Iterator[tuple[Batch, float]]:
        wanted = ",".join(str(identity) for identity in lookup)
        read = 0
        try:
            (total,) = self.database.execute("SELECT max(rowid) FROM messages").fetchone()
            cursor = self.database.execute(f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({wanted}) ORDER BY rowid")
            while rows := cursor.fetchmany(ROWS):
                read += len(rows)
                yield _batch(rows, lookup), min(1.0, read / max(1, total or 1))
        except sqlite3.DatabaseError as error:
            self.notes.append(f"{self.path.name}: damaged ({error}); the {read} messages before that are read")


def _batch(rows: Sequence[tuple[int, int, bytes]], lookup: dict[int, int]) -> Batch:
    rows = [row for row in rows if isinstance(row[2], bytes) and isinstance(row[1], int) and row[0] in lookup]
    data = [row[2] for row in rows]
    length = np.array([len(item) for item in data], np.int64)
    topic = np.array([lookup[row[0]] for row in rows], np.int64)
    return Batch(
        topic=topic,
        log_time=np.array([row[1] for row in rows], np.int64),
        start=np.cumsum(length) - length,
        length=length,
        buffer=np.frombuffer(b"".join(data), np.uint8),
    )
