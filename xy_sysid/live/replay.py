"""The identifier's logic on blocks from any source, at full speed: the same updates, bit for bit, as the live node."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from xy_sysid.live.fitter import LiveFitter, Update
from xy_sysid.live.identifier import Identifier
from xy_sysid.samples.block import Block, StreamName
from xy_sysid.settings import IdentifierSettings


def replay(
    blocks: Iterable[tuple[StreamName, Block]], settings: IdentifierSettings, axes: tuple[str, ...], identifier: Identifier | None = None
) -> Iterator[Update]:
    """Updates in order, lazily; pass an ``identifier`` of your own to read its counters afterwards."""
    identifier = identifier or Identifier(settings, axes)
    fitter = LiveFitter(settings)
    for kind, block in blocks:
        for request in identifier.feed(kind, block):
            yield fitter.fit(request)
