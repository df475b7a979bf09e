"""Hash of the content of a file or a folder, independent of its name and place."""

from __future__ import annotations

import hashlib
from pathlib import Path

from xy_sysid.bags.opening import regular_file


def digest(path: Path) -> str:
    """SHA-256 of a file; for a folder, of the names and hashes of its files, sorted by name. Raises OSError, or BadRecording for a pipe."""
    if not path.is_dir():
        regular_file(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    total = hashlib.sha256()
    for item in sorted(item for item in path.rglob("*") if item.is_file()):
        total.update(f"{item.relative_to(path).as_posix()}\0{digest(item)}\n".encode("utf-8", "surrogateescape"))
    return total.hexdigest()
