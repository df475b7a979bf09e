"""ASAM MDF (.mf4, .mdf), by asammdf. Every group of channels has its own time; values are physical."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def leaves(path: str) -> Iterator[tuple[str, Any, str, str]]:
    """Channels of numbers, with the instants of their group."""
    from asammdf import MDF

    with MDF(path) as file:
        for group in range(len(file.groups)):
            clock = f"time of group {group + 1}"
            signals = [signal for signal in _signals(file, group) if signal.samples.ndim == 1 and signal.samples.dtype.kind in "fiub" and len(signal)]
            if signals:
                yield clock, signals[0].timestamps, "s", ""
            for signal in signals:
                yield signal.name, signal.samples, signal.unit or "", clock


def _signals(file: Any, group: int) -> list[Any]:
    master = file.masters_db.get(group)
    return [file.get(group=group, index=index) for index in range(len(file.groups[group].channels)) if index != master]
