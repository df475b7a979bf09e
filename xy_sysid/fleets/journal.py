"""Rows that are not in the table yet. Each is written to disk at once, so that a killed run loses none.

The journal is a file of JSON lines in the table's folder. It is locked while a run writes it: one run for a table at a time.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import IO, Any

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import ENDING, merged

FILE = ".journal.jsonl"  # readers of Parquet leave out names that begin with a dot
MANY = 500  # rows after which the journal is merged into the table


class Journal:
    """The rows of a run that wait to be merged into the table."""

    def __init__(self, folder: Path, file: IO[str], library: Library) -> None:
        self._folder, self._file, self._library = folder, file, library
        self._rows: list[Row] = []
        file.seek(0)
        for line in file:
            with suppress(json.JSONDecodeError):  # an incomplete last line of a killed run
                self._rows.append({name: _read(name, value) for name, value in json.loads(line).items()})
        self.fold()

    def add(self, rows: Sequence[Row]) -> None:
        """Store the rows of a recording."""
        self._rows += rows  # first: Ctrl-C may interrupt the writing, and these rows go into the table
        for row in rows:
            self._file.write(json.dumps({name: _written(value) for name, value in row.items()}) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        if len(self._rows) >= MANY:
            self.fold()

    def fold(self) -> None:
        """Merge all rows into the table and clear the journal. After a kill it merges again; the same rows replace themselves."""
        if self._rows:
            merged(self._folder, self._rows, self._library)
        self._rows = []
        self._file.seek(0)
        self._file.truncate()


@contextmanager
def journal(folder: Path, library: Library = STANDARD) -> Iterator[Journal]:
    """The journal of a table; the table is created if it does not exist. At the end, also after an error, its rows are in the table.

    Raises BadInput if another run works on the table, BadRecording if it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        own_files(folder)
        file = os.fdopen(os.open(folder / FILE, os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW, 0o666), "a+", encoding="utf-8")
    except OSError as error:
        raise BadRecording(folder, f"cannot be written ({error.strerror or error})", "Choose a folder that you may write to.") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise BadInput("table", str(folder), "one that no other run is writing", "Wait until that one ends, or choose another folder.") from None
        kept = Journal(folder, file, library)
        try:
            yield kept
        finally:
            kept.fold()


def own_files(folder: Path) -> None:
    """Raises BadRecording if a file that a run writes is a link or not a regular file: the run would change something outside the table.

    The journal is also opened without following links, in case one is created meanwhile.
    """
    for path in (folder / FILE, *sorted(folder.glob(f"*{ENDING}"))):
        if path.is_symlink() or (path.exists() and not path.is_file()):
            what = f"a link to {path.resolve()}" if path.is_symlink() else "no file"
            raise BadRecording(path, f"{what}, and a run writes only files of the table's folder", "Remove it, or choose another folder.")


def _written(value: Any) -> Any:
    return value.isoformat() if isinstance(value, datetime) else value


def _read(name: str, value: Any) -> Any:
    return datetime.fromisoformat(value) if name == "date" and value is not None else value
