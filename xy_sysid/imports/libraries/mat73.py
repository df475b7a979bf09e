"""MATLAB version 7.3, which is HDF5, by h5py. Leaves are named as in older versions: ``meas.Y(2).Data``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

DEEPEST = 24  # levels of structs in structs
MOST = 20_000  # items of one cell or array of structs
OWN = ("#refs#", "#subsystem#")  # groups in which MATLAB stores the contents of cells, and objects


def declared(path: str) -> int:
    """Unpacked size of all arrays, bytes."""
    import h5py

    sizes: list[int] = []
    with h5py.File(path, "r") as file:
        file.visititems(lambda _, item: sizes.append(item.nbytes) if isinstance(item, h5py.Dataset) else None)
    return sum(sizes)


def leaves(path: str) -> Iterator[tuple[str, Any]]:
    """Names and arrays, or lists of words."""
    import h5py

    with h5py.File(path, "r") as file:
        for name, item in file.items():
            if name not in OWN:
                yield from walked(file, name, item)


def walked(file: Any, name: str, item: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    """The leaves of one variable. A struct is a group, a cell an array of references, and so is each field of an array of structs."""
    import h5py

    if depth > DEEPEST:
        return
    if isinstance(item, h5py.Group):
        for field, inner in item.items():
            if _is_references(inner) and "MATLAB_class" not in inner.attrs:
                for number, one in enumerate(inner[()].ravel(order="F")[:MOST], 1):
                    yield from walked(file, f"{name}({number}).{field}", file[one], depth + 1)
            else:
                yield from walked(file, f"{name}.{field}", inner, depth + 1)
    elif _is_references(item):
        items = [file[one] for one in item[()].ravel(order="F")[:MOST]]
        if items and all(_class(one) == "char" for one in items):
            yield name, [_text(one) for one in items]
        else:
            for number, one in enumerate(items, 1):
                yield from walked(file, name if len(items) == 1 else f"{name}{{{number}}}", one, depth + 1)
    elif _class(item) == "char":
        yield name, [_text(item)]
    elif "MATLAB_empty" not in item.attrs and item.dtype.kind in "fiub":
        yield name, np.squeeze(item[()].T)
    elif "MATLAB_empty" not in item.attrs and item.dtype.names == ("real", "imag"):
        yield name, np.squeeze((item["real"] + 1j * item["imag"]).T)


def _is_references(item: Any) -> bool:
    import h5py

    return isinstance(item, h5py.Dataset) and item.dtype == h5py.ref_dtype


def _class(item: Any) -> str:
    found = item.attrs.get("MATLAB_class", b"")
    return found.decode() if isinstance(found, bytes) else str(found)


def _text(item: Any) -> str:
    return "" if "MATLAB_empty" in item.attrs else "".join(map(chr, item[()].T.ravel().tolist()))
