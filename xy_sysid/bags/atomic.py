"""Files are written whole or not at all: a full disk, Ctrl-C or a lost supply leaves what was there before, and no stump."""

from __future__ import annotations

import os
import secrets
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from xy_sysid.errors import BadRecording

PART = ".xy_part_"  # begins the hidden folder beside the file; only kill -9 and a lost supply leave one behind
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
        folder = target.parent / f"{PART}{secrets.token_hex(8)}"
        try:  # the name is known before the folder is there: a signal at any moment finds what to remove
            folder.mkdir(0o700)
            part = folder / target.name
            yield part
            if part.exists():
                if target.exists():
                    shutil.copymode(target, part)
                flushed(part)
                part.replace(target)
                _sync(target.parent)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    except (OSError, sqlite3.Error) as problem:  # sqlite's own words for a full disk
        why = f"cannot be written ({getattr(problem, 'strerror', None) or problem})"
        raise BadRecording(path, why, "Make room on the disk, or choose another place; what was there is untouched.") from None
    except BadRecording as problem:  # of a writer, which knows the other place only
        raise BadRecording(path, problem.problem, problem.act) from None


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


def _stream(path: Path) -> bool:
    return str(path).startswith(STREAMS) or (path.exists() and not path.is_file() and not path.is_dir())
