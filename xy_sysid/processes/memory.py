"""Freed memory stays with the process. By default the C library returns each large array to the system, and asks for it again page by page."""

from __future__ import annotations

import ctypes
import os

TRIM, MMAP = 2**28, 2**25  # bytes: free memory that is kept, and size of an array that always goes back
ENVIRONMENT = {"MALLOC_TRIM_THRESHOLD_": TRIM, "MALLOC_MMAP_THRESHOLD_": MMAP}
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h of glibc


def keep_freed_memory() -> None:
    """Set this for the present process and for those that it starts; without effect with another C library than glibc."""
    for name, size in ENVIRONMENT.items():
        os.environ.setdefault(name, str(size))
    setting = getattr(ctypes.CDLL(None), "mallopt", None)
    if setting is not None:
        setting(_M_TRIM_THRESHOLD, TRIM)
        setting(_M_MMAP_THRESHOLD, MMAP)
