"""The first line of a model file holds the checksum of the rest, so that a truncated or changed file is detected."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from xy_sysid.errors import BadRecording

LINE = re.compile(r"# sha256 of all lines below: (\w*)[^\n]*\n")
HINT = "after a change by hand, delete this line"


def sealed(text: str) -> str:
    """The text after a line with its checksum; for YAML, that line is a comment."""
    return f"# sha256 of all lines below: {_sum(text)} ({HINT})\n{text}"


def unsealed(path: Path, text: str) -> str:
    """The text without its first line, if that was a checksum.

    Raises BadRecording for a wrong checksum, or if a file of an older version without one ends inside a line.
    """
    found = LINE.match(text)
    if found is None:
        if text and not text.endswith("\n"):
            raise BadRecording(path, "ends inside a line, so it was cut off", "Take another copy, or write the model again.")
        return text
    rest = text[found.end() :]
    if _sum(rest) != found.group(1):
        problem = "was cut off or changed since it was written (the sum in its first line differs)"
        raise BadRecording(path, problem, "Take another copy; if you changed it yourself, delete that line.")
    return rest


def _sum(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
