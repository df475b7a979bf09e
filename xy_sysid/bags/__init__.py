"""Reading and writing of rosbag2: messages --> check of their layout --> blocks, and blocks --> a bag that is complete even after a crash.

reading:                               a full recording: its files, topics, messages
sqlite_file, pages:                    a .db3, by SQL or directly from its pages
mcap_file, mcap_records, compression, checksum: an .mcap, its records and its chunks
sums:                                  checksums for .db3 files, which have none of their own
opening:                               checks before a file is opened
atomic:                                files that are written completely or not at all
cdr, stride:                           check of the layout, then arrays without deserializing each message
streaming:                             blocks of voltage and position in log order
writing:                               a bag that is complete at any moment, and its message definitions
sqlite_writer, mcap_writer:            its files
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xy_sysid.bags.reading import Bag, Topic
    from xy_sysid.bags.streaming import POSITION, REFERENCE, VOLTAGE, stream_blocks
    from xy_sysid.bags.writing import BagWriter

__all__ = ["POSITION", "REFERENCE", "VOLTAGE", "Bag", "BagWriter", "Topic", "stream_blocks"]

_HOMES = {"reading": ("Bag", "Topic"), "streaming": ("POSITION", "REFERENCE", "VOLTAGE", "stream_blocks"), "writing": ("BagWriter",)}
_HOME = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import each name at its first use, so that writing a file or a bag need not wait for the compiler of the readers."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(importlib.import_module(f"xy_sysid.bags.{_HOME[name]}"), name)
    globals()[name] = found
    return found
