"""NI TDMS, by npTDMS. A waveform has its start and increment; other channels have no times except as a column of their group."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np


def leaves(path: str) -> Iterator[tuple[str, Any, str, str]]:
    """Channels of numbers, with their instants where they are waveforms."""
    from nptdms import TdmsFile

    file = TdmsFile.read(path)
    several = len(file.groups()) > 1
    starts = [start for group in file.groups() for channel in group.channels() if (start := channel.properties.get("wf_start_time")) is not None]
    for group in file.groups():
        for channel in group.channels():
            name = f"{group.name}.{channel.name}" if several else channel.name
            values = channel[:]
            kind = getattr(values, "dtype", np.dtype(object)).kind
            if kind == "M":
                yield name, (values - values[:1]) / np.timedelta64(1, "s"), "s", ""
            elif kind in "fiub" and len(values):
                clock = f"time of {name}" if channel.properties.get("wf_increment") else ""
                if clock:
                    start = channel.properties.get("wf_start_time")
                    later = 0.0 if start is None else float((start - min(starts)) / np.timedelta64(1, "s"))
                    yield clock, channel.time_track() + later, "s", ""
                yield name, values, str(channel.properties.get("unit_string") or ""), clock
