"""Files that an external library reads --> leaves: numbers and words by name, read in a separate process, since the library may crash."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording, MissingExtra
from xy_sysid.imports.limits import COPY, fits, room

CHILD = Path(__file__).with_name("guarded_child.py")
LIBRARIES = Path(__file__).parent / "libraries"
LONGEST = 120.0  # s for any file that fits in memory


@dataclass(frozen=True, slots=True)
class Leaf:
    """Numbers, or words as an array of text. clock: name of the leaf with their instants, s; "" if there is none."""

    name: str
    values: NDArray[Any]
    unit: str = ""
    clock: str = ""


def leaves(path: Path, reader: str, extra: str = "") -> list[Leaf]:
    """The leaves that a reader of ``libraries`` finds in a file. extra: of this package, installs the library. Raises BadRecording, MissingExtra."""
    # -P: the folder of the child does not hide Python's own modules
    command = [sys.executable, "-P", str(CHILD), str(LIBRARIES / f"{reader}.py"), str(path.absolute()), str(int(room()))]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST, check=False)
    except subprocess.TimeoutExpired:
        raise BadRecording(path, f"not read as {path.suffix} within {LONGEST:.0f} s", COPY) from None
    line, _, data = done.stdout.partition(b"\n")
    why = (done.stderr.decode("utf-8", "replace").strip().splitlines() or [""])[-1]
    if done.returncode == 1 and why:  # the library raised an error
        raise BadRecording(path, f"not readable as {path.suffix} ({why[:120]})", COPY)
    if done.returncode != 0 or not line:
        how = f"signal {-done.returncode}" if done.returncode < 0 else f"exit code {done.returncode}"
        raise BadRecording(path, f"not readable as {path.suffix}: the process of the reader crashed ({how}; {(why or how)[:100]})", COPY)
    told = json.loads(line)
    if "missing" in told:
        raise MissingExtra(f"{told['missing']}, which reads {path.name},", extra)
    if "size" in told:
        fits(path, max(float(told["size"]), room() + 1.0))
    return list(_unpacked(told["leaves"], data))


def _unpacked(told: list[dict[str, Any]], data: bytes) -> Iterable[Leaf]:
    at = 0
    for leaf in told:
        if "words" in leaf:
            yield Leaf(leaf["name"], np.array(leaf["words"], dtype=np.str_), leaf["unit"], leaf["clock"])
            continue
        kind, shape = np.dtype("<" + leaf["kind"]), tuple(leaf["shape"])
        count = int(np.prod(shape, dtype=np.int64))
        yield Leaf(leaf["name"], np.frombuffer(data, kind, count, at).reshape(shape), leaf["unit"], leaf["clock"])
        at += count * kind.itemsize
