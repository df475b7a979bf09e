"""rosbag2 in and out: messages --> proof of layout --> blocks, and blocks --> a bag that survives its recorder.

reading:                               a recording as a whole: its files, topics, messages
sqlite_file, pages:                    a .db3, by SQL or straight from its pages
mcap_file, mcap_records, compression, checksum: an .mcap, its records and its chunks
sums:                                  check sums for what has none of its own
opening:                               what is looked at before a file is opened
atomic:                                files that are written whole or not at all
cdr, stride:                           proof of layout, then arrays without deserializing each
streaming:                             blocks of voltage and position in log order
writing:                               a bag that is complete at any moment, and the definitions that it carries
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
    """Each name when it is first used: who writes a file or a bag need not wait for the compiler of the readers."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(importlib.import_module(f"xy_sysid.bags.{_HOME[name]}"), name)
    globals()[name] = found
    return found
