"""A full rosbag2 recording: a folder with metadata.yaml and one or more files, or a single file."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from types import TracebackType
from typing import Any

import numpy as np
import yaml

from xy_sysid.bags.compression import decompressor, expand
from xy_sysid.bags.mcap_file import McapFile
from xy_sysid.bags.opening import PARSER, regular_file, too_much
from xy_sysid.bags.sqlite_file import SqliteFile
from xy_sysid.bags.stride import Batch
from xy_sysid.bags.sums import check_sums
from xy_sysid.errors import BadRecording

STORAGES: Mapping[str, type[SqliteFile] | type[McapFile]] = {".db3": SqliteFile, ".mcap": McapFile}
ANOTHER_COPY = "Take another copy of the bag."
METADATA = 1 << 21  # bytes; no bag has longer metadata
WORDS = 100_000  # most parts of metadata of a bag
DIGITS = 20  # most digits of a number of messages
KNOWN = "a rosbag2 folder, .db3, .mcap"


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a bag; kind is its message type."""

    name: str
    kind: str


class Bag:
    """A recording opened for reading: ``topics``, ``batches``, and ``notes`` on anomalies.

    Raises BadRecording, one line, if nothing can be read.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.notes: list[str] = []
        self.counts: dict[str, int] = {}
        self._expected: dict[str, int] = {}
        self._closed = contextlib.ExitStack()
        self._compressed: str | None = None
        self.custom: dict[str, str] = {}
        with contextlib.ExitStack() as undo:
            undo.callback(self._closed.close)
            self.files = [self._open(file) for file in self._find()]
            if check_sums(self.path) == "damaged":
                self.notes.append("its check sums cannot be computed because of the damage: some values may differ from those recorded")
            undo.pop_all()
        self.topics = list(dict.fromkeys(Topic(name, kind) for file in self.files for name, kind in file.topics))

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._closed.close()

    def kind(self, topic: str) -> str | None:
        """Message type of a topic; None for an unknown topic."""
        return next((item.kind for item in self.topics if item.name == topic), None)

    def of_kind(self, kind: str) -> list[str]:
        """Names of the topics of a message type."""
        return [item.name for item in self.topics if item.kind == kind]

    def listing(self) -> str:
        """The topics with their types, in words."""
        return ", ".join(f"{item.name} ({item.kind.rsplit('/', 1)[-1]})" for item in self.topics) or "no topics"

    def batches(self, wanted: Sequence[str]) -> Iterator[tuple[Batch, float]]:
        """Messages of these topics in log order, with the fraction of the recording that has been read (0..1)."""
        unpack: Callable[[bytes, int], bytes] | None = decompressor(self._compressed, self.path) if self._compressed else None
        self.counts = dict.fromkeys(wanted, 0)
        for index, file in enumerate(self.files):
            for batch, part in file.batches(wanted, unpack):
                for number, count in enumerate(np.bincount(batch.topic, minlength=len(wanted)).tolist()):
                    self.counts[wanted[number]] += count
                yield batch, (index + part) / len(self.files)
        for name in wanted:
            expected = self._expected.get(name)
            if expected is not None and expected != self.counts[name]:
                self.notes.append(f"metadata.yaml says {expected} messages on {name}; {self.counts[name]} are there and were read")

    def bad(self, problem: str, act: str) -> BadRecording:
        """The error for this bag; its text starts with the notes."""
        return BadRecording(self.path, "; ".join([*self.notes, problem]), act)

    def _open(self, path: Path) -> SqliteFile | McapFile:
        try:
            regular_file(path)
            with path.open("rb") as content:
                if not content.read(1):
                    raise BadRecording(path, "the file is empty (0 bytes)", ANOTHER_COPY)
            file = STORAGES[path.suffix](path, self.notes)
        except OSError as error:
            raise BadRecording(path, f"cannot be opened ({error.strerror})", "Check the path and the permissions.") from None
        self._closed.callback(file.close)
        return file

    def _find(self) -> list[Path]:
        path = self.path
        try:
            path.stat()
        except OSError as error:
            raise BadRecording(path, f"cannot be opened ({error.strerror})", "Check the path and the permissions.") from None
        if not path.is_dir():
            if path.suffix not in STORAGES:
                raise BadRecording(path, f"a file of kind {path.suffix or '(none)'!r}, not a bag", f"Give one of: {KNOWN}.")
            return [path]
        try:
            present = sorted(item for item in path.iterdir() if item.suffix in STORAGES)
        except OSError as error:
            raise BadRecording(path, f"cannot be opened ({error.strerror})", "Check the path and the permissions.") from None
        try:
            metadata = self._metadata(path)
        except BadRecording as error:
            if not present:
                raise
            self.notes.append(f"{error.problem}; the files in the folder are read")
            return present
        if metadata is None:
            if not present:
                raise BadRecording(path, "a folder without metadata.yaml, .db3 or .mcap, so not a bag", f"Give one of: {KNOWN}.")
            self.notes.append("no metadata.yaml; the files in the folder are read")
            return present
        return self._named(metadata, present)

    def _metadata(self, path: Path) -> dict[str, Any] | None:
        file = path / "metadata.yaml"
        try:
            if not file.exists():
                return None
            regular_file(file)
            if file.stat().st_size > METADATA:
                raise BadRecording(file, f"metadata.yaml of {file.stat().st_size / 1e6:.3g} MB, which no bag has", ANOTHER_COPY)
            content = _yaml(file, file.read_text("utf-8"))
        except OSError as error:
            raise BadRecording(file, f"cannot be read ({error.strerror})", "Check the permissions.") from None
        except (yaml.YAMLError, UnicodeDecodeError):
            raise BadRecording(file, "metadata.yaml is not YAML", ANOTHER_COPY) from None
        information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
        names = information.get("relative_file_paths") if isinstance(information, dict) else None
        if not isinstance(information, dict) or not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise BadRecording(file, "metadata.yaml does not describe a rosbag2", ANOTHER_COPY)
        return information

    def _named(self, metadata: dict[str, Any], present: list[Path]) -> list[Path]:
        named = [self.path / PurePath(name.replace("\0", "?")).name for name in metadata["relative_file_paths"]]
        mode = _word(metadata.get("compression_mode")).lower()
        method = _word(metadata.get("compression_format")) or "zstd"
        if mode == "message":
            self._compressed = method
        custom = metadata.get("custom_data")
        self.custom = {str(key): str(value) for key, value in custom.items()} if isinstance(custom, dict) else {}
        for file in named:
            if file.exists():
                regular_file(file)
        found = [file for file in dict.fromkeys(named) if file.is_file()]
        missing = [file.name for file in named if not file.is_file()]
        if missing:
            others = [file for file in present if file not in named]
            self.notes.append(
                f"metadata.yaml names {', '.join(missing)}, not there" + (f"; {', '.join(o.name for o in others)} is read" if others else "")
            )
            found += others
            if not found:
                raise BadRecording(self.path, f"metadata.yaml names {', '.join(missing)}, which is not there", "Copy that file into the folder too.")
        else:
            self._expect(metadata)
        return [self._expand(file, method) if mode == "file" and file.suffix not in STORAGES else self._checked(file) for file in found]

    def _checked(self, file: Path) -> Path:
        if file.suffix not in STORAGES:
            raise BadRecording(self.path, f"metadata.yaml names {file.name}, which is neither .db3 nor .mcap", "Record as sqlite3 or mcap.")
        return file

    def _expect(self, metadata: dict[str, Any]) -> None:
        with contextlib.suppress(KeyError, TypeError, ValueError):
            counted = metadata["topics_with_message_count"]
            self._expected = {str(item["topic_metadata"]["name"]): int(item["message_count"][:DIGITS]) for item in counted}

    def _expand(self, file: Path, method: str) -> Path:
        """A file compressed as a whole, decompressed to a temporary folder."""
        folder = Path(self._closed.enter_context(tempfile.TemporaryDirectory()))
        target = self._checked(folder / file.stem)
        expand(file, target, method)
        return target


def _yaml(path: Path, text: str) -> Any:
    """The content, all values as text; raises BadRecording for a document that is too long or deep to be a recorder's."""
    if too_much(text, WORDS):
        raise BadRecording(path, "metadata.yaml is nested, repeated or long in a way that no recorder writes", ANOTHER_COPY)
    return yaml.load(text, Loader=PARSER)


def _word(value: object) -> str:
    """The text; empty for YAML's null, and for a value that is not text."""
    return value if isinstance(value, str) and value not in ("null", "~") else ""
