"""The status of the streams of a node: never OK while nothing is paired."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from xy_sysid.live.plain_messages import ERROR, OK, STALE, WARN
from xy_sysid.samples.block import StreamName


@dataclass(frozen=True, slots=True)
class Heard:
    """What came since the last look.

    silent:    streams of which no message came
    paired:    samples that were paired
    refused:   why the newest refused message was refused, empty if none was; refusals: how many were since the start
    stamps:    why stamped samples cannot be counted, empty if they can
    sentences: what the pairing says, by reason
    streams:   that are listened to
    """

    silent: tuple[StreamName, ...]
    paired: int
    refused: str
    refusals: int
    stamps: str
    sentences: Mapping[str, str]
    streams: tuple[StreamName, ...] = ("voltage", "position")


def verdict(heard: Heard, well: str) -> tuple[int, str]:
    """Level and sentence of the status; ``well`` is the sentence if all is."""
    said = [heard.stamps] if heard.stamps else []
    if heard.refused:
        said.append(f"{heard.refusals} message{'s' if heard.refusals > 1 else ''} refused: {heard.refused}")
    said += heard.sentences.values()
    if heard.silent:
        return STALE, "; ".join((f"no {' and no '.join(heard.silent)} received for a second", *said))
    if not heard.paired:
        return (ERROR, f"nothing is paired: {'; '.join(said)}") if said else (WARN, "nothing is paired yet")
    return (WARN, "; ".join(said)) if said else (OK, well)
