"""Files are written whole or not at all: a full disk, Ctrl-C or a lost supply leaves what was there before, and no stump.

What is written stands in a hidden folder beside its place until it is complete. Its writer holds a lock on that folder, which
the system releases when the writer ends, however it ends: after kill -9 the next writer finds the folder unlocked and removes it.
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

PART = ".xy_part_"  # begins the hidden folder beside the file; only kill -9 and a lost supply leave one behind, until the next writer comes
OF_A_WRITER = re.compile(re.escape(PART) + "[0-9a-f]{16}")
DIRECTORY = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW
STREAMS = ("/dev/stdout", "/dev/stderr", "/dev/fd/", "/proc/")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Where to write instead; it becomes ``path`` once it is complete and on the disk, and is gone if anything goes wrong.

    What is written may be a file, or a folder where there is none yet. The name stays the same, the folder is another. A
    link is followed, a file keeps its mode, and what is no file (a pipe, a terminal) is written to as it is.
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
    except (OSError, sqlite3.Error) as problem:  # sqlite's own words for a full disk
        why = f"cannot be written ({getattr(problem, 'strerror', None) or problem})"
        raise BadRecording(path, why, "Make room on the disk, or choose another place; what was there is untouched.") from None
    except BadRecording as problem:  # of a writer, which knows the other place only
        raise BadRecording(path, problem.problem, problem.act) from None


@contextmanager
def _folder(beside: Path) -> Iterator[Path]:
    """A new hidden folder that is locked as long as its writer lives, and gone at the end."""
    with ExitStack() as stack:
        while True:
            folder = beside / f"{PART}{secrets.token_hex(8)}"
            stack.callback(shutil.rmtree, folder, ignore_errors=True)  # before it is there: a signal at any moment finds what to remove
            folder.mkdir(0o700)
            try:
                handle = os.open(folder, DIRECTORY)
            except FileNotFoundError:
                continue  # another writer saw it before it was locked, and removed it
            stack.callback(os.close, handle)
            _locked(handle, fcntl.LOCK_EX)
            if folder.exists():
                break
        yield folder


def _remove_abandoned(place: Path) -> None:
    """Remove the hidden folders of writers that are dead; those of the living are locked, and other users' cannot be opened."""
    with os.scandir(place) as items:
        found = [place / item.name for item in items if OF_A_WRITER.fullmatch(item.name) and item.is_dir(follow_symlinks=False)]
    for folder in found:
        with suppress(OSError):
            handle = os.open(folder, DIRECTORY)
            if _locked(handle, fcntl.LOCK_EX | fcntl.LOCK_NB):
                shutil.rmtree(folder, ignore_errors=True)
            os.close(handle)


def _locked(handle: int, way: int) -> bool:
    """False where another holds the lock, or on a file system that has none: then nothing is ever removed there."""
    try:
        fcntl.flock(handle, way)
    except OSError:
        return False
    return True


def write_text(path: Path, text: str) -> None:
    """A text file, whole or not at all. Raises BadRecording."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")


def flushed(path: Path) -> None:
    """Wait until a file, or a folder with all that is in it, is on the disk. Raises OSError."""
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
    """Whether writing there would replace something: a file, a folder, or a link, even one that leads nowhere. A pipe loses nothing."""
    return os.path.lexists(path) and not _stream(path)


def _stream(path: Path) -> bool:
    return str(path).startswith(STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())
