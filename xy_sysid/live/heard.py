"""The status of the streams of a node: never OK while nothing is paired."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from xy_sysid.live.plain_messages import ERROR, OK, STALE, WARN
from xy_sysid.samples.block import StreamName


@dataclass(frozen=True, slots=True)
class Heard:
    """What arrived since the last check.

    silent:    streams without a message
    paired:    number of paired samples
    refused:   reason for the newest refused message, empty without one; refusals: their number since the start
    stamps:    why stamped samples cannot be counted, empty if they can
    sentences: messages of the pairing, by reason
    streams:   subscribed streams
    """

    silent: tuple[StreamName, ...]
    paired: int
    refused: str
    refusals: int
    stamps: str
    sentences: Mapping[str, str]
    streams: tuple[StreamName, ...] = ("voltage", "position")


def verdict(heard: Heard, well: str) -> tuple[int, str]:
    """Level and sentence of the status; ``well`` is the sentence if there is no problem."""
    said = [heard.stamps] if heard.stamps else []
    if heard.refused:
        said.append(f"{heard.refusals} message{'s' if heard.refusals > 1 else ''} refused: {heard.refused}")
    said += heard.sentences.values()
    if heard.silent:
        return STALE, "; ".join((f"no {' and no '.join(heard.silent)} received for a second", *said))
    if not heard.paired:
        return (ERROR, f"nothing is paired: {'; '.join(said)}") if said else (WARN, "nothing is paired yet")
    return (WARN, "; ".join(said)) if said else (OK, well)
