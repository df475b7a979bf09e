"""Files are written completely or not at all: after a full disk, Ctrl-C or a power failure the old file remains, and no partial one.

A new file is in a hidden folder next to its place until it is complete. The writer holds a lock on that folder, which
the system always releases when the writer ends: after kill -9 the next writer finds the folder unlocked and removes it.
"""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from xy_sysid.errors import BadRecording

PART = ".xy_part_"  # prefix of the hidden folder; after kill -9 or a power failure it remains until the next writer removes it
OF_A_WRITER = re.compile(re.escape(PART) + "[0-9a-f]{16}")
DIRECTORY = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW
STREAMS = ("/dev/stdout", "/dev/stderr", "/dev/fd/", "/proc/")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A temporary path to write to; it becomes ``path`` once it is complete and on the disk, and is removed after an error.

    Write a file there, or a folder if ``path`` does not exist yet. The temporary path has the same name in another folder. A
    link is followed, a file keeps its mode, and a pipe or a terminal is written to directly.
    Raises BadRecording, one line that names ``path``, if it cannot be written.
    """
    try:
        if _stream(path):
            yield path
            return
        target = path.resolve()
        _remove_abandoned(target.parent)
        with _folder(target.parent) as folder:
            part = folder / target.name
            yield part
            if part.exists():
                if target.exists():
                    shutil.copymode(target, part)
                flushed(part)
                part.replace(target)
                _sync(target.parent)
    except (OSError, sqlite3.Error) as problem:  # sqlite reports a full disk with its own error
        why = f"cannot be written ({getattr(problem, 'strerror', None) or problem})"
        raise BadRecording(path, why, "Make room on the disk, or choose another place; what was there is untouched.") from None
    except BadRecording as problem:  # of a writer, which names the temporary path
        raise BadRecording(path, problem.problem, problem.act) from None


@contextmanager
def _folder(beside: Path) -> Iterator[Path]:
    """A new hidden folder that is locked while its writer runs, and removed at the end."""
    with ExitStack() as stack:
        while True:
            folder = beside / f"{PART}{secrets.token_hex(8)}"
            stack.callback(shutil.rmtree, folder, ignore_errors=True)  # before it is created, so that it is removed after a signal at any moment
            folder.mkdir(0o700)
            try:
                handle = os.open(folder, DIRECTORY)
            except FileNotFoundError:
                continue  # another writer removed it before it was locked
            stack.callback(os.close, handle)
            _locked(handle, fcntl.LOCK_EX)
            if folder.exists():
                break
        yield folder


def _remove_abandoned(place: Path) -> None:
    """Remove the hidden folders of writers that have ended; those in use are locked, and those of other users cannot be opened."""
    with os.scandir(place) as items:
        found = [place / item.name for item in items if OF_A_WRITER.fullmatch(item.name) and item.is_dir(follow_symlinks=False)]
    for folder in found:
        with suppress(OSError):
            handle = os.open(folder, DIRECTORY)
            if _locked(handle, fcntl.LOCK_EX | fcntl.LOCK_NB):
                shutil.rmtree(folder, ignore_errors=True)
            os.close(handle)


def _locked(handle: int, way: int) -> bool:
    """False if another process holds the lock, or on a file system without locks, where nothing is ever removed."""
    try:
        fcntl.flock(handle, way)
    except OSError:
        return False
    return True


def write_text(path: Path, text: str) -> None:
    """Write a text file, completely or not at all. Raises BadRecording."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")


def flushed(path: Path) -> None:
    """Wait until a file, or a folder with all its files, is on the disk. Raises OSError."""
    if path.is_dir():
        for item in path.iterdir():
            flushed(item)
    _sync(path)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def taken(path: Path) -> bool:
    """True if writing there would replace a file, a folder, or a link, even a broken one; False for a pipe."""
    return os.path.lexists(path) and not _stream(path)


def _stream(path: Path) -> bool:
    return str(path).startswith(STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())
