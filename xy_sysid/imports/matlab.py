"""MAT --> leaves: every number and word of a MATLAB file by its name, read in a process that may crash."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording
from xy_sysid.imports.limits import fits, room

CHILD = Path(__file__).with_name("mat_child.py")
COPY = "Take another copy of the file."
V73 = "Save it in MATLAB with save(name, '-v7')."
LONGEST = 120.0  # s for any file that fits in memory
Arrays = Mapping[str, NDArray[Any]]


def read_mat(path: Path) -> Arrays:
    """The leaves of all variables up to version 7: numbers, and words as arrays of text. Raises BadRecording."""
    with path.open("rb") as file:
        head = file.read(128)
    if head.startswith((b"MATLAB 7.3", b"\x89HDF")):
        raise BadRecording(path, "a MATLAB file of version 7.3 (HDF5), which is not read here", V73)
    # -P: the folder of the child does not hide Python's own modules
    command = [sys.executable, "-P", str(CHILD), str(path.absolute()), str(int(room()))]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        raise BadRecording(path, f"not read as .mat within {LONGEST:.0f} s", COPY) from None
    line, _, data = done.stdout.partition(b"\n")
    if done.returncode != 0 or not line:
        how = f"signal {-done.returncode}" if done.returncode < 0 else f"exit code {done.returncode}"
        why = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or [how]
        raise BadRecording(path, f"not readable as .mat: the reader's own process died of it ({how}; {why[0][:100]})", COPY)
    told = json.loads(line)
    if "size" in told:
        fits(path, max(float(told["size"]), room() + 1.0))
    if "problem" in told:
        raise BadRecording(path, f"not readable as .mat ({told['problem']})", COPY)
    return _leaves(told["leaves"], data)


def _leaves(told: list[dict[str, Any]], data: bytes) -> Arrays:
    found: dict[str, NDArray[Any]] = {}
    at = 0
    for leaf in told:
        if "words" in leaf:
            found[leaf["name"]] = np.array(leaf["words"], dtype=np.str_)
            continue
        kind, shape = np.dtype("<" + leaf["kind"]), tuple(leaf["shape"])
        count = int(np.prod(shape, dtype=np.int64))
        found[leaf["name"]] = np.frombuffer(data, kind, count, at).reshape(shape)
        at += count * kind.itemsize
    return found
