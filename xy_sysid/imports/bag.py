"""A rosbag2 --> Recording."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.bags.reading import Bag
from xy_sysid.bags.streaming import Kind, choose, pieces, units
from xy_sysid.errors import BadInput
from xy_sysid.imports.pairing import LATE, Stream, cut, gather, is_jitter, pair, steady
from xy_sysid.recording import Recording
from xy_sysid.stream import Block

WHOLE = 1 << 40  # samples; blocks as long as they come
MARGIN = 1.0  # s kept around the part that was asked for, for samples that came late
COPIES = 4  # times the size of the samples that pairing needs while it works
SHARE = 0.6  # of the machine's memory that a recording may take


def load_bag(
    path: Path,
    voltage_topic: str,
    position_topic: str,
    joint_topic: str | None,
    axes: Sequence[str] | None,
    effort_as_voltage: bool,
    start: float,
    stop: float | None,
    progress: Callable[[float], None] | None,
) -> Recording:
    """See ``xy_sysid.imports.load``."""
    with Bag(path) as bag:
        source = choose(bag, voltage_topic, position_topic, joint_topic, effort_as_voltage)
        kept, first = _collect(bag, pieces(bag, source, WHOLE, progress), start, stop)
        notes = bag.notes
        named: dict[Kind, str] = {"voltage": "effort" if source.effort else voltage_topic, "position": source.joints or position_topic}
        for kind, name in named.items():
            if kind not in first:
                raise bag.bad(f"no samples on {name} that can be read", "Record while the source publishes.")
            if not sum(map(len, kept.get(kind, []))):
                raise BadInput("start", f"{start:g} s", "within the recording", "Begin earlier.")
        same, common = _axes(bag, kept, axes, source.joints is not None, notes)
        streams: dict[str, Stream] = {kind: gather(kind, blocks, common, notes, bag.bad) for kind, blocks in same.items() if blocks}
        if source.effort:
            streams = _in_order(streams, notes)
            if not source.said:
                notes.append("there is no voltage topic; the joints' effort is the input")
            if not np.any(streams["voltage"].values):
                raise bag.bad(f"the effort on {source.joints} is zero throughout and there is no {voltage_topic}", "Record the voltage too.")
        if source.joints is not None and not source.effort:
            notes.append("joint states are paired with the voltage by their stamps")
        if source.effort and not source.said:
            notes.append("joint states name no unit; effort and position are carried as they are")
        return cut(pair(streams, str(path), units(bag, source), notes, bag.bad), first["position"], start, stop)


def _collect(bag: Bag, blocks: Iterator[tuple[Kind, Block]], start: float, stop: float | None) -> tuple[dict[Kind, list[Block]], dict[Kind, float]]:
    """The blocks that touch the part asked for, and the first instant of each kind; never more than fits in memory."""
    kept: dict[Kind, list[Block]] = {}
    first: dict[Kind, float] = {}
    latest: dict[Kind, float] = {}
    over: set[Kind] = set()
    restarted, size = False, 0
    room = SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / COPIES
    for kind, block in blocks:
        finite = block.time[np.isfinite(block.time)]
        if not finite.size:
            continue
        begin = first.setdefault(kind, float(finite[0]))
        restarted |= float(finite[0]) < latest.get(kind, -np.inf) - LATE
        latest[kind] = max(latest.get(kind, -np.inf), float(finite[-1]))
        if not restarted and (start > 0 or stop is not None):
            elapsed = block.time - begin
            if stop is not None and float(finite.min()) - begin > stop + MARGIN:
                over.add(kind)
                if over >= {"voltage", "position"}:
                    break
                continue
            inside = ~((elapsed < start - MARGIN) | (elapsed > (np.inf if stop is None else stop + MARGIN)))
            block = Block(block.axes, block.seq[inside], block.time[inside], block.values[inside])
        kept.setdefault(kind, []).append(block)
        size += block.values.nbytes + block.seq.nbytes + block.time.nbytes
        if size > room:
            raise bag.bad(f"more than {size / 1e9:.1f} GB of samples, too long to load at once", "Give a part with --span, or replay it.")
    return kept, first


def _axes(
    bag: Bag, kept: dict[Kind, list[Block]], wanted: Sequence[str] | None, joints: bool, notes: list[str]
) -> tuple[dict[Kind, list[Block]], tuple[str, ...]]:
    """Blocks that have the axes to be read, and these axes; raises BadRecording if there are none in common."""
    names: dict[Kind, tuple[str, ...]] = {kind: blocks[0].axes for kind, blocks in kept.items()}
    same: dict[Kind, list[Block]] = {kind: [block for block in blocks if block.axes == names[kind]] for kind, blocks in kept.items()}
    for kind, blocks in kept.items():
        lost = sum(map(len, blocks)) - sum(map(len, same[kind]))
        if lost:
            notes.append(f"{lost} samples of {kind} have other columns than {', '.join(names[kind])}; they are left out")
    inputs, outputs = names["voltage"], names["position"]
    common = tuple(name for name in inputs if name in outputs)
    if not common and joints and len(inputs) == len(outputs):
        notes.append(f"the joints {', '.join(outputs)} are taken as the axes {', '.join(inputs)}, in this order")
        same["position"] = [Block(inputs, block.seq, block.time, block.values) for block in same["position"]]
        common = outputs = inputs
    if not common:
        raise bag.bad(f"no axis in common: voltage has {', '.join(inputs)}, position {', '.join(outputs)}", "Give both the same column names.")
    if set(inputs) != set(outputs):
        notes.append(f"voltage has the axes {', '.join(inputs)} and position {', '.join(outputs)}; {', '.join(common)} are read")
    if wanted is None:
        return same, common
    unknown = [name for name in wanted if name not in common]
    if unknown:
        raise BadInput("axis", ", ".join(unknown), ", ".join(common), "Choose some of these.")
    return same, tuple(wanted)


def _in_order(streams: dict[str, Stream], notes: list[str]) -> dict[str, Stream]:
    """Joint states whose stamps jitter too much to count by, but of which none is lost, are numbered as they came."""
    time = streams["position"].time
    if len(time) < 2 or len(streams["voltage"].seq) != len(time) or not is_jitter(np.diff(streams["position"].seq)):
        return streams
    notes.append("the stamps jitter by more than half a sample; samples are numbered as they came, with even times")
    count, even = np.arange(len(time), dtype=np.float64), steady(time)
    return {name: Stream(stream.axes, count, even, stream.values) for name, stream in streams.items()}
