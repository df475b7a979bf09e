"""Writes a rosbag2 that is always complete up to the last second, so that a killed recorder loses no more than that."""

from __future__ import annotations

import functools
import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal, Protocol

from xy_sysid.bags.atomic import taken
from xy_sysid.bags.cdr import ARRAY_TYPE, encode_array
from xy_sysid.bags.mcap_writer import McapWriter
from xy_sysid.bags.sqlite_writer import SqliteWriter
from xy_sysid.bags.sums import Sums
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.samples.block import Block, FloatArray, columns, pack

Storage = Literal["sqlite3", "mcap"]
EVERY = 1.0  # seconds between two commits
MOST = 1 << 22  # bytes; a commit comes earlier if this much is waiting
VERSION = 9  # of metadata.yaml, as ROS 2 Jazzy writes it


@dataclass(slots=True)
class Written:
    """One topic of the written bag."""

    number: int
    kind: str
    digest: str
    count: int = 0


class StorageWriter(Protocol):
    """Writer of one file."""

    def add(self, number: int, topic: str, kind: str, text: str, digest: str) -> None: ...
    def write(self, number: int, log_time: int, data: bytes) -> None: ...
    def flush(self) -> None: ...
    def close(self, metadata: str) -> None: ...


WRITERS: dict[Storage, tuple[str, type[SqliteWriter] | type[McapWriter]]] = {"sqlite3": (".db3", SqliteWriter), "mcap": (".mcap", McapWriter)}


class BagWriter:
    """A new bag: a folder with metadata.yaml, or a single file if the path ends in .db3 or .mcap.

    Use it as a context manager. Data reach the disk at the first write a second later; call ``flush``
    from a timer if a stream may pause. custom: texts for metadata.yaml (folders only).
    Raises BadRecording if the path exists or cannot be written, BadInput for a wrong ``storage``.
    """

    def __init__(self, path: Path | str, storage: Storage | None = None, custom: dict[str, str] | None = None) -> None:
        self.path = Path(path)
        named: dict[str, Storage] = {ending: name for name, (ending, _) in WRITERS.items()}
        bare = self.path.suffix in named
        self.storage: Storage = storage or (named[self.path.suffix] if bare else "sqlite3")
        if self.storage not in WRITERS:
            raise BadInput("storage", repr(storage), ", ".join(WRITERS), "Choose one of these.")
        ending, writer = WRITERS[self.storage]
        if bare and named[self.path.suffix] != self.storage:
            raise BadInput("storage", repr(storage), named[self.path.suffix], f"A file that ends in {self.path.suffix} is that.")
        if bare and custom:
            raise BadRecording(self.path, "a bare file has no place for units", "Save to a folder (a name without an ending).")
        self.custom = custom or {}
        self.topics: dict[str, Written] = {}
        self._sums = Sums() if self.storage == "sqlite3" and not bare else None  # mcap has sums of its own
        self.first, self.last = 0, 0
        self._waiting, self._flushed = 0, time.monotonic()
        try:
            if taken(self.path):
                raise BadRecording(self.path, "exists already", "Choose another name; nothing is overwritten.")
            (self.path.parent if bare else self.path).mkdir(parents=True, exist_ok=True)
            self.file = self.path if bare else self.path / f"{self.path.name}{ending}"
            self.metadata = None if bare else self.path / "metadata.yaml"
            self.writer: StorageWriter = writer(self.file)
            self._describe()
        except OSError as error:
            raise BadRecording(self.path, f"cannot be written ({error.strerror})", "Choose a folder that you may write to.") from None

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def write_block(self, topic: str, block: Block, log_time_ns: int) -> None:
        """Write one message of samples."""
        sizes = (len(block), 2 + len(block.axes))
        self.write_raw(topic, ARRAY_TYPE, encode_array(("sample", columns(block.axes)), sizes, pack(block)), log_time_ns)

    def write_array(self, topic: str, labels: Sequence[str], sizes: Sequence[int], data: FloatArray, log_time_ns: int) -> None:
        """Write any std_msgs/Float64MultiArray, row-major."""
        self.write_raw(topic, ARRAY_TYPE, encode_array(tuple(labels), tuple(sizes), data.ravel()), log_time_ns)

    def write_raw(self, topic: str, type_name: str, cdr_bytes: bytes, log_time_ns: int) -> None:
        """Write a serialized message; type_name like ``sensor_msgs/msg/JointState``."""
        written = self.topics.get(topic)
        if written is None:
            text, digest = definition(type_name)
            written = self.topics[topic] = Written(len(self.topics) + 1, type_name, digest)
            self.writer.add(written.number, topic, type_name, text, digest)
        elif written.kind != type_name:
            raise BadInput(f"type on {topic}", type_name, written.kind, "One topic carries one type.")
        self.first = log_time_ns if self.count == 0 else min(self.first, log_time_ns)
        self.last = max(self.last, log_time_ns)
        self.writer.write(written.number, log_time_ns, cdr_bytes)
        if self._sums is not None:
            self._sums.add(topic, cdr_bytes)
        written.count += 1
        self._waiting += len(cdr_bytes)
        if self._waiting >= MOST or time.monotonic() - self._flushed >= EVERY:
            self.flush()

    @property
    def count(self) -> int:
        """Number of messages written so far."""
        return sum(written.count for written in self.topics.values())

    def flush(self) -> None:
        """Write all waiting messages to the disk; the bag is then complete up to here."""
        if self._waiting:
            self.writer.flush()
            self._describe()
        self._waiting, self._flushed = 0, time.monotonic()

    def close(self) -> None:
        """Finish the bag; a second call does nothing."""
        writer, self.writer = self.writer, _Closed()
        writer.close(json.dumps(self._information()))
        if not isinstance(writer, _Closed):
            self._describe()

    def _describe(self) -> None:
        """Rewrite metadata.yaml (JSON is YAML), completely or not at all."""
        if self.metadata is None:
            return
        half = self.metadata.with_suffix(".yaml.tmp")
        with half.open("w", encoding="utf-8") as file:
            file.write(json.dumps({"rosbag2_bagfile_information": self._information()}, indent=1) + "\n")
            file.flush()
            os.fsync(file.fileno())
        half.replace(self.metadata)

    def _information(self) -> dict[str, object]:
        span = {"duration": {"nanoseconds": self.last - self.first}, "starting_time": {"nanoseconds_since_epoch": self.first}}
        return {
            "version": VERSION,
            "storage_identifier": self.storage,
            "relative_file_paths": [self.file.name],
            **span,
            "message_count": self.count,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": name,
                        "type": item.kind,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": [],
                        "type_description_hash": item.digest,
                    },
                    "message_count": item.count,
                }
                for name, item in self.topics.items()
            ],
            "compression_format": "",
            "compression_mode": "",
            "files": [{"path": self.file.name, **span, "message_count": self.count}],
            "custom_data": {**self.custom, **(self._sums.text() if self._sums else {})} or None,
            "ros_distro": "jazzy",
        }


class _Closed:
    """The writer of a closed bag; it accepts no messages."""

    def add(self, number: int, topic: str, kind: str, text: str, digest: str) -> None:
        raise BadInput("bag", "closed", "open", "Write before closing it.")

    def write(self, number: int, log_time: int, data: bytes) -> None:
        raise BadInput("bag", "closed", "open", "Write before closing it.")

    def flush(self) -> None:
        return

    def close(self, metadata: str) -> None:
        return


@functools.cache
def definition(kind: str) -> tuple[str, str]:
    """(text of the definition, hash) of a message type of ROS 2 Jazzy, which a bag contains so that it can be read without ROS.

    Both are empty for an unknown type.
    """
    from rosbags.typesys import Stores, get_typestore
    from rosbags.typesys.base import TypesysError

    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        return store.generate_msgdef(kind, ros_version=2)[0], store.hash_rihs01(kind)
    except (TypesysError, KeyError):
        return "", ""
