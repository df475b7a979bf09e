"""Limits of the size of files: a file is unpacked only if its size fits in memory."""

from __future__ import annotations

import os
from pathlib import Path

from xy_sysid.errors import BadRecording

COPY = "Take another copy of the file."  # advice for a damaged file
SHARE = 0.6  # of the machine's memory that a recording may take
MOST_COLUMNS = 10_000  # of a table, or arrays of a file; no recording has more signals
COPIES = 4  # memory for reading and pairing, as a multiple of the size


def room() -> float:
    """Bytes of samples that may be loaded at once."""
    return SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / COPIES


def fits(path: Path, size: float, what: str = "unpacked") -> None:
    """Raises BadRecording if this many bytes do not fit in memory."""
    if size > room():
        problem = f"{what} it would take {size / 1e9:.3g} GB, and {room() / 1e9:.2g} GB may be loaded at once"
        raise BadRecording(path, problem, "Store a shorter part, or as a rosbag2 and give a part with --span.")
