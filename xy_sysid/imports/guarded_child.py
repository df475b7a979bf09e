"""Reads one file with an external library in a separate process, since a library can crash its process or fill its memory.

Run as ``python -P guarded_child.py READER FILE BYTES``: READER is a file of ``libraries/``. The process limits its memory, and writes one line of
JSON and then the numbers to stdout. It imports nothing of this package, so it starts quickly.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import resource
import sys
from types import ModuleType
from typing import Any

MOST = 20_000  # leaves


def main(reader: str, path: str, most: int) -> None:
    """Answer on stdout: {"leaves": [...]}, {"size": bytes} for a file that is too large, or {"missing": module}.

    Any other error of a library ends this process with exit code 1 and the reason in the last line of stderr.
    """
    import numpy as np

    found: list[dict[str, Any]] = []
    numbers: list[Any] = []
    try:
        module = _loaded(reader)
        size = module.declared(path) if hasattr(module, "declared") else 0
        if size > most:
            return answer({"size": size})
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_AS, (3 * most + 4_000_000_000, resource.RLIM_INFINITY))
        for name, value, unit, clock in (leaf if len(leaf) == 4 else (*leaf, "", "") for leaf in module.leaves(path)):
            if len(found) >= MOST:
                break
            told = {"name": name, "unit": unit, "clock": clock}
            if isinstance(value, list):
                found.append({**told, "words": value})
                continue
            value = np.asarray(value)
            kind = "c16" if value.dtype.kind == "c" else "f8"
            found.append({**told, "kind": kind, "shape": list(value.shape)})
            numbers.append(np.ascontiguousarray(value, "<" + kind))
    except ImportError as error:
        return answer({"missing": str(error.name or error)})
    except MemoryError:
        return answer({"size": most + 1})
    answer({"leaves": found})
    for item in numbers:
        sys.stdout.buffer.write(item.tobytes())
    sys.stdout.buffer.flush()
    return None


def _loaded(reader: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location("reader", reader)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def answer(document: dict[str, Any]) -> None:
    """Write the first line of the answer."""
    sys.stdout.buffer.write(json.dumps(document).encode() + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
