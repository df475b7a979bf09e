"""A long recording in parts of equal length: each sample is read once, and only a few parts of a bag are in memory at a time."""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from xy_sysid.bags.reading import Bag
from xy_sysid.bags.streaming import pieces
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import finished, from_table, load
from xy_sysid.imports.bag import KINDS, MARGIN, WHOLE, check_room, chosen, size_of, together
from xy_sysid.imports.paired_streams import LATE, cut
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.registry import BAG, format_of
from xy_sysid.samples.block import Block, FloatArray, StreamName
from xy_sysid.samples.recording import Recording

SHORTEST = MARGIN  # s, least length of a part


def in_parts(path: Path, reading: Reading, every: float) -> Iterator[tuple[int, Recording]]:
    """Number and samples of each part that has samples; the first begins at ``reading.start``, the last ends at ``reading.stop``.

    every: duration of a part, s, ``SHORTEST`` at least. A new part begins where the source of a bag restarts.
    Raises BadRecording or BadInput as ``imports.load``.
    """
    found = False
    with np.errstate(all="ignore"):
        try:
            kind = format_of(path)
            for number, part in _of_bag(path, reading, every) if kind is BAG else _of_table(path, reading, every):
                found = True
                yield number, finished(path, part)
        except OSError as error:
            raise BadRecording(path, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
    if not found:
        yield 0, load(path, reading)  # or its error


def _span(reading: Reading, every: float, number: int) -> Reading:
    """Reading options for a part."""
    start = reading.start + number * every
    return dataclasses.replace(reading, start=start, stop=min(start + every, math.inf if reading.stop is None else reading.stop))


def _last(reading: Reading, every: float) -> float:
    """Number of the last part."""
    return math.inf if reading.stop is None else math.ceil((reading.stop - reading.start) / every - 1e-9) - 1


def _of_table(path: Path, reading: Reading, every: float) -> Iterator[tuple[int, Recording]]:
    whole, first = from_table(path, format_of(path), reading)
    for number in _numbers(whole.time - first - reading.start, every, 1e-9):
        if 0 <= number <= _last(reading, every):
            span = _span(reading, every, number)
            with suppress(BadInput):  # too few samples for a part
                yield number, cut(whole, first, span.start, span.stop)


def _numbers(elapsed: FloatArray, every: float, margin: float) -> list[int]:
    """The numbers of the parts that contain the instants, s, or are within a margin of them."""
    return [int(number) for number in np.unique(np.floor(np.concatenate([elapsed - margin, elapsed, elapsed + margin]) / every))]


def _counted(blocks: Iterator[tuple[StreamName, Block]]) -> Iterator[tuple[StreamName, int, Block, FloatArray]]:
    """Each block with the number of restarts of its stream before it, and its finite instants. A single late block is no restart."""
    starts: dict[StreamName, int] = {}
    latest: dict[StreamName, float] = {}
    odd: dict[StreamName, tuple[Block, FloatArray]] = {}
    for kind, block in blocks:
        known = block.time[np.isfinite(block.time)]
        if not known.size:
            continue
        behind, before = float(known[0]) < latest.get(kind, -math.inf) - LATE, odd.pop(kind, None)
        if behind and before is None:
            odd[kind] = block, known
            continue
        if behind:
            starts[kind], latest[kind] = starts.get(kind, 0) + 1, -math.inf
        latest[kind] = max(latest.get(kind, -math.inf), float(known[-1]))
        for one in (before, (block, known)):
            if one is not None:
                yield kind, starts.get(kind, 0), *one
    for kind, one in odd.items():
        yield kind, starts.get(kind, 0), *one


def _of_bag(path: Path, reading: Reading, every: float) -> Iterator[tuple[int, Recording]]:
    waiting: dict[int, dict[StreamName, list[Block]]] = {}
    sizes: dict[int, int] = {}  # bytes of each of them
    begins = [0]  # number of the first part after each start of the source
    origins: dict[tuple[StreamName, int], float] = {}  # the instant of each start from which its parts count, s
    reached: dict[StreamName, int] = {}  # number of the part that the stream has reached
    done = 0  # all parts before this number were yielded
    with Bag(path) as bag:
        source = chosen(bag, reading)

        def made(number: int) -> Iterator[tuple[int, Recording]]:
            blocks, origin = waiting.pop(number), origins.get(("position", bisect.bisect_right(begins, number) - 1))
            del sizes[number]
            said = len(bag.notes)
            if origin is not None:
                with suppress(BadInput):  # too few samples for a part
                    yield number, together(bag, source, blocks, origin - reading.start, _span(reading, every, number))
            del bag.notes[said:]  # the notes of this part

        for kind, start, block, known in _counted(pieces(bag, source, WHOLE, None)):
            if start == len(begins):
                begins.append(max([*waiting, *reached.values()]) + 1)
            origin = origins.setdefault((kind, start), float(known[0]) - begins[start] * every + (0.0 if start else reading.start))
            numbers = _numbers(known - origin, every, MARGIN)
            for number in numbers:
                if max(begins[start], done) <= number <= _last(reading, every):
                    elapsed = block.time - origin - number * every
                    inside = ~((elapsed < -MARGIN) | (elapsed >= every + MARGIN))
                    part = Block(block.axes, block.seq[inside], block.time[inside], block.values[inside])
                    waiting.setdefault(number, {}).setdefault(kind, []).append(part)
                    sizes[number] = sizes.get(number, 0) + size_of(part)
            check_room(bag, sum(sizes.values()))
            reached[kind] = max(reached.get(kind, 0), numbers[0])
            ends = [reached.get(one, 0) for one in KINDS]
            if min(ends) > _last(reading, every):
                break
            for number in sorted(waiting):
                if number < min(ends) or number < max(ends) - 1:  # both streams are beyond it, or one by a whole part
                    done = number + 1
                    yield from made(number)
        for number in sorted(waiting):
            yield from made(number)
