"""Replay of a bag: the identifier gets the same data as live, with any fault of the streams."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from xy_sysid.bags import BagWriter, stream_blocks
from xy_sysid.live.identifier import FitRequest, Identifier
from xy_sysid.samples.block import Block
from xy_sysid.samples.pairing import Quantity
from xy_sysid.settings import IdentifierSettings

RATE, ROWS = 2000.0, 20


def messages(seed: int, samples: int) -> list[tuple[Quantity, Block]]:
    """Voltage and position in their order of arrival: late, twice, spoilt, and with a counter that restarts at the end."""
    random = np.random.default_rng(seed)
    found: list[tuple[float, Quantity, Block]] = []
    for start, length in ((0, samples), (samples, samples // 2)):
        u = random.standard_normal((length, 1))
        for kind, values in (("voltage", u), ("position", 1e-3 * np.cumsum(u, axis=0))):
            for first in range(0, length, ROWS):
                seq = np.arange(first, first + ROWS, dtype=np.float64)
                if random.random() < 0.002:
                    seq[3] = seq[9]
                block = Block(("x",), seq, (start + seq) / RATE, values[first : first + ROWS])
                late = 4.0 * ROWS if random.random() < 0.02 else 0.0
                copies = 2 if random.random() < 0.01 else 1
                found += [(start + first + late, "voltage" if kind == "voltage" else "position", block)] * copies
    found.sort(key=lambda item: item[0])
    return [(kind, block) for _, kind, block in found]


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bag_of_bad_streams_gives_what_was_heard_live(tmp_path: Path, storage: Literal["sqlite3", "mcap"], seed: int) -> None:
    """Requests, responses, counts of faults: all equal, although a replay takes many messages at once."""
    settings = IdentifierSettings(length=1024, refit=1.0)
    live, again = Identifier(settings, ("x",)), Identifier(settings, ("x",))
    first: list[FitRequest] = []
    with BagWriter(tmp_path / "bag", storage) as bag:
        for number, (kind, block) in enumerate(messages(seed, 40_000)):
            bag.write_block(f"/xy/{kind}", block, 10**9 + number * 10**6)
            first += live.feed(kind, block)
    second: list[FitRequest] = []
    for name, block in stream_blocks(tmp_path / "bag"):
        assert name != "reference"
        second += again.feed(name, block)
    assert len(first) > 10
    assert live.faults == again.faults
    assert live.dropped == again.dropped
    assert {"bad_counter", "restart", "late"} <= set(live.faults)
    assert [request.seq for request in first] == [request.seq for request in second]
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.axes["x"].frf.response, other.axes["x"].frf.response)
