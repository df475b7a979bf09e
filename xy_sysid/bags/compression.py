"""zstd and lz4, as bags use them; both libraries come with rosbags."""

from __future__ import annotations

import contextlib
import importlib
import shutil
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from xy_sysid.errors import BadRecording


class Damaged(ValueError):
    """Compressed bytes that do not decompress."""


MODULES = {"zstd": ("compression.zstd", "backports.zstd"), "lz4": ("lz4.frame",)}


def _module(method: str, path: Path) -> ModuleType:
    if method not in MODULES:
        raise BadRecording(path, f"compressed with {method!r}, which is not known here", "Store the bag without compression, or with zstd or lz4.")
    for name in MODULES[method]:
        with contextlib.suppress(ImportError):
            return importlib.import_module(name)
    raise BadRecording(path, f"compressed with {method}, but no library for it is installed", "Install it with: pip install rosbags")


def _errors(module: ModuleType) -> tuple[type[Exception], ...]:
    return (RuntimeError, ValueError, EOFError, OSError, getattr(module, "ZstdError", EOFError))


def decompressor(method: str, path: Path) -> Callable[[bytes], bytes]:
    """The function that undoes ``method`` ("zstd" or "lz4") and raises Damaged; raises BadRecording for another one."""
    module = _module(method, path)

    def undo(data: bytes) -> bytes:
        try:
            return bytes(module.decompress(data))
        except _errors(module) as error:
            raise Damaged(str(error)) from None

    return undo


def expand(source: Path, target: Path, method: str) -> None:
    """Write a compressed file out; raises BadRecording."""
    module = _module(method, source)
    try:
        with module.open(source, "rb") as packed, target.open("wb") as out:
            shutil.copyfileobj(packed, out)
    except _errors(module) as error:
        raise BadRecording(source, f"does not decompress ({error})", "Take another copy of the bag.") from None
