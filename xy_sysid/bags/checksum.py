"""CRC-32 of the chunks of an MCAP file: Intel's where it is installed, a tenth of zlib's time; zlib's is half of reading a file."""

from __future__ import annotations

from collections.abc import Callable

try:
    from isal.isal_zlib import crc32 as _crc32
except ImportError:  # no wheel for this processor
    from zlib import crc32 as _crc32

crc32: Callable[[bytes | memoryview], int] = _crc32
