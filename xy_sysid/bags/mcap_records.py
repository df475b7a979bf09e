"""Start of an MCAP file, and of its records. Source: mcap.dev/spec."""

from __future__ import annotations

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 2, 3, 4, 5, 6, 15
