"""MATLAB up to version 7, by scipy. Structs and cells are resolved into leaves with names like ``meas.Y(2).Data``."""

from __future__ import annotations

import contextlib
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

DEEPEST = 24  # levels of structs in structs
MOST = 20_000  # items of one cell or array of structs
COMPRESSED = 15  # miCOMPRESSED, MAT-File Format, table 1-1


def declared(path: str) -> int:
    """Unpacked size of the variables of a version 5 file, as it states, bytes; 0 for other files."""
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


def leaves(path: str) -> Iterator[tuple[str, Any]]:
    """Names and arrays, or lists of words."""
    import scipy.io

    for name, value in scipy.io.loadmat(path, squeeze_me=True, struct_as_record=True).items():
        if not name.startswith("__"):
            yield from walked(name, value)


def walked(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """The leaves of one variable."""
    value = np.asarray(value)
    if depth > DEEPEST:
        return
    if value.dtype.names:
        for number, item in enumerate(value.ravel()[:MOST], 1):
            place = name if value.size == 1 else f"{name}({number})"
            for field in value.dtype.names:
                yield from walked(f"{place}.{field}", item[field], depth + 1)
    elif value.dtype.kind in "US":
        yield name, [str(one) for one in value.ravel()[:MOST]]
    elif value.dtype.kind == "O":
        items = [np.asarray(one) for one in value.ravel()[:MOST]]
        if items and all(one.dtype.kind in "US" and one.size <= 1 for one in items):
            yield name, [str(one.item()) if one.size else "" for one in items]
        else:
            for number, one in enumerate(items, 1):
                yield from walked(name if value.size == 1 else f"{name}{{{number}}}", one, depth + 1)
    elif value.dtype.kind in "fiubc":
        yield name, value
