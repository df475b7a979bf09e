"""Decompression of zstd and lz4, up to a maximum size; both libraries come with rosbags."""

from __future__ import annotations

import contextlib
import importlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from xy_sysid.bags.stride import Batch
from xy_sysid.errors import BadRecording

MESSAGE = 1 << 26  # bytes; no message of a bag is longer
SWOLLEN = 200  # largest ratio of decompressed to compressed size; no file of samples has a larger one
LEAST = 1 << 26  # bytes; decompressed size that is allowed for any file
PIECE = 1 << 20  # bytes written at once
FREE = 0.5  # largest used fraction of the free space for temporary files


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


def decompressor(method: str, path: Path) -> Callable[[bytes, int], bytes]:
    """A function that decompresses ``method`` ("zstd" or "lz4") up to a number of bytes, or raises Damaged. Raises BadRecording for other methods."""
    module = _module(method, path)
    begin: Callable[[], Any] = module.LZ4FrameDecompressor if method == "lz4" else module.ZstdDecompressor

    def undo(data: bytes, most: int) -> bytes:
        found = b""
        try:
            while data:
                one = begin()
                found += one.decompress(data, max_length=most + 1 - len(found))
                if len(found) > most:
                    raise Damaged(f"it becomes more than {most} bytes")
                if not one.eof:
                    raise Damaged("it ends early")
                data = one.unused_data
        except _errors(module) as error:
            raise Damaged(str(error)) from None
        return found

    return undo


def unpacked(batch: Batch, undo: Callable[[bytes, int], bytes]) -> tuple[Batch, int]:
    """Individually compressed messages, decompressed, without the damaged ones, and the number of these."""
    found: list[bytes] = []
    kept: list[int] = []
    for place, (start, length) in enumerate(zip(batch.start.tolist(), batch.length.tolist(), strict=True)):
        try:
            found.append(undo(batch.buffer[start : start + length].tobytes(), MESSAGE))
        except Damaged:
            continue
        kept.append(place)
    sizes = np.array([len(one) for one in found], np.int64)
    buffer = np.frombuffer(b"".join(found), np.uint8)
    whole = Batch(topic=batch.topic[kept], log_time=batch.log_time[kept], start=np.cumsum(sizes) - sizes, length=sizes, buffer=buffer)
    return whole, len(batch.start) - len(kept)


def whole_ones(
    batches: Iterator[tuple[Batch, float]], undo: Callable[[bytes, int], bytes] | None, name: str, notes: list[str]
) -> Iterator[tuple[Batch, float]]:
    """The batches of a file, decompressed if its messages are; a note gives the number of damaged messages."""
    bad = 0
    for batch, part in batches:
        if undo is not None:
            batch, damaged = unpacked(batch, undo)
            bad += damaged
        yield batch, part
    if bad:
        notes.append(f"{name}: {bad} compressed messages are damaged; they are left out")


def expand(source: Path, target: Path, method: str) -> None:
    """Decompress a file; raises BadRecording if it is damaged, or becomes larger than a recording can be."""
    module = _module(method, source)
    most = min(max(SWOLLEN * source.stat().st_size, LEAST), int(FREE * shutil.disk_usage(target.parent).free))
    size = 0
    try:
        with module.open(source, "rb") as packed, target.open("wb") as out:
            while piece := packed.read(PIECE):
                size += len(piece)
                if size > most:
                    problem = f"becomes more than {most / 1e6:.0f} MB, {most / max(source.stat().st_size, 1):.0f} times its size"
                    raise BadRecording(source, problem, "Unpack it yourself, if it is a recording and there is space.")
                out.write(piece)
    except _errors(module) as error:
        raise BadRecording(source, f"does not decompress ({error})", "Take another copy of the bag.") from None
