"""Reads one MATLAB file in a process of its own, since scipy's reader can crash the process it runs in.

Run as ``python -P mat_child.py FILE BYTES``: limits its own memory, and writes one line of JSON and then the numbers to
stdout. Each leaf of the variables (structs and cells are walked into) has a name like ``meas.Y(2).Data``. It imports nothing
of the package, so that it starts quickly.
"""

from __future__ import annotations

import contextlib
import json
import resource
import struct
import sys
import zlib
from collections.abc import Iterator
from typing import Any

DEEPEST = 24  # levels of structs in structs
MOST = 20_000  # leaves
COMPRESSED = 15  # miCOMPRESSED, MAT-File Format, table 1-1
BAD = (OSError, ValueError, EOFError, KeyError, TypeError, IndexError, NotImplementedError, zlib.error, struct.error, RecursionError, OverflowError)


def declared(path: str) -> int:
    """Bytes that the variables of a version 5 file say they take when unpacked."""
    with open(path, "rb") as file:
        head = file.read(128)
        if len(head) < 128 or head[126:128] not in (b"IM", b"MI"):
            return 0
        order = "<" if head[126:128] == b"IM" else ">"
        total = 0
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(order + "II", tag)
            if kind == COMPRESSED:
                with contextlib.suppress(zlib.error, struct.error):
                    total += struct.unpack_from(order + "I", zlib.decompressobj().decompress(file.read(min(size, 256)), 8), 4)[0]
                file.seek(max(0, size - 256), 1)
            else:
                total += size
                file.seek(size, 1)
        return total


def leaves(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Names and arrays, or lists of words."""
    import numpy as np

    value = np.asarray(value)
    if depth > DEEPEST:
        return
    if value.dtype.names:
        for number, item in enumerate(value.ravel()[:MOST], 1):
            place = name if value.size == 1 else f"{name}({number})"
            for field in value.dtype.names:
                yield from leaves(f"{place}.{field}", item[field], depth + 1)
    elif value.dtype.kind in "US":
        yield name, [str(one) for one in value.ravel()[:MOST]]
    elif value.dtype.kind == "O":
        items = [np.asarray(one) for one in value.ravel()[:MOST]]
        if items and all(one.dtype.kind in "US" and one.size <= 1 for one in items):
            yield name, [str(one.item()) if one.size else "" for one in items]
        else:
            for number, one in enumerate(items, 1):
                yield from leaves(name if value.size == 1 else f"{name}{{{number}}}", one, depth + 1)
    elif value.dtype.kind in "fiubc":
        yield name, value


def main(path: str, most: int) -> None:
    """Answer on stdout: {"leaves": [...]} or {"problem": ...}."""
    import numpy as np
    import scipy.io

    size = declared(path)
    if size > most:
        answer({"size": size})
        return
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (3 * most + 4_000_000_000, resource.RLIM_INFINITY))
    try:
        content = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=True)
    except (*BAD, scipy.io.matlab.MatReadError) as error:
        answer({"problem": (str(error).splitlines() or [type(error).__name__])[0][:120]})
        return
    except MemoryError:
        answer({"size": most + 1})
        return
    found: list[dict[str, Any]] = []
    numbers: list[Any] = []
    for name, value in content.items():
        if name.startswith("__"):
            continue
        for leaf, item in leaves(name, value):
            if len(found) >= MOST:
                break
            if isinstance(item, list):
                found.append({"name": leaf, "words": item})
            else:
                kind = "c16" if item.dtype.kind == "c" else "f8"
                found.append({"name": leaf, "kind": kind, "shape": list(item.shape)})
                numbers.append(np.ascontiguousarray(item, "<" + kind))
    answer({"leaves": found})
    for item in numbers:
        sys.stdout.buffer.write(item.tobytes())
    sys.stdout.buffer.flush()


def answer(document: dict[str, Any]) -> None:
    """The first line."""
    sys.stdout.buffer.write(json.dumps(document).encode() + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
