"""A file or a folder -> the hash of what is in it, whatever it is called and wherever it lies."""

from __future__ import annotations

import hashlib
from pathlib import Path

from xy_sysid.bags.opening import regular_file


def digest(path: Path) -> str:
    """SHA-256 of a file; of a folder that of its files' names and hashes, in the order of their names. Raises OSError, or BadRecording for a pipe."""
    if not path.is_dir():
        regular_file(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    total = hashlib.sha256()
    for item in sorted(item for item in path.rglob("*") if item.is_file()):
        total.update(f"{item.relative_to(path).as_posix()}\0{digest(item)}\n".encode("utf-8", "surrogateescape"))
    return total.hexdigest()
