"""A rosbag2 --> Recording."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.bags.reading import Bag
from xy_sysid.bags.streaming import Source, Topics, choose, pieces, units
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.even import drifts, even
from xy_sysid.imports.given import in_units
from xy_sysid.imports.limits import room
from xy_sysid.imports.paired_streams import LATE, Stream, cut, filled, gather, hollow, is_jitter, pair, steady
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.block import Block, StreamName
from xy_sysid.samples.recording import Recording

KINDS: tuple[StreamName, ...] = ("voltage", "position")
WHOLE = 1 << 40  # samples; blocks are not divided
MARGIN = 1.0  # s around the requested part, for late samples


def load_bag(path: Path, reading: Reading, progress: Callable[[float], None] | None) -> Recording:
    """The recording of a bag; see ``xy_sysid.imports.load``."""
    with Bag(path) as bag:
        source = chosen(bag, reading)
        kept, first = _collect(bag, pieces(bag, source, WHOLE, progress), reading.start, reading.stop)
        named: dict[StreamName, str] = {
            "voltage": "effort" if source.effort else reading.voltage_topic,
            "position": source.joints or reading.position_topic,
        }
        for kind, name in named.items():
            if kind not in first:
                raise bag.bad(f"no samples on {name} that can be read", "Record while the source publishes.")
        return together(bag, source, kept, first["position"], reading)


def chosen(bag: Bag, reading: Reading) -> Source:
    """The topics of a bag to read. Raises BadInput for options of tables, BadRecording for a bag without these topics."""
    if reading.columns or reading.rate is not None:
        given = f"for {bag.path}"
        raise BadInput("--map or --rate", given, "for a table", "A bag has topics and stamps: choose topics with --topic, or leave it out.")
    return choose(bag, topics(reading))


def together(bag: Bag, source: Source, kept: dict[StreamName, list[Block]], first: float, reading: Reading) -> Recording:
    """The blocks of a part as a recording. first: the instant, s, from which ``reading`` counts its start and stop.

    Irregularities are added to ``bag.notes``. Raises BadInput if the part has no samples.
    """
    path, notes, start, stop = bag.path, bag.notes, reading.start, reading.stop
    if not all(sum(map(len, kept.get(kind, []))) for kind in KINDS):
        raise BadInput("start", f"{start:g} s", "within the recording", "Begin earlier.")
    same, common = _axes(bag, kept, reading.axes, source.joints is not None, notes)
    empty = _empty(same)
    common = tuple(common[place] for place in filled(common, [axis in empty for axis in common], notes))
    streams: dict[str, Stream] = {kind: gather(kind, blocks, common, notes, bag.bad) for kind, blocks in same.items() if blocks}
    if source.effort:
        streams |= _in_order(path, streams, source.lag, notes)
        if "reference" in streams:
            streams["reference"] = _by_stamp(streams["reference"], streams["position"])
        if not source.said:
            notes.append("there is no voltage topic; the joints' effort is the input")
        if not np.any(streams["voltage"].values):
            raise bag.bad(f"the effort on {source.joints} is zero throughout and there is no {reading.voltage_topic}", "Record the voltage too.")
    if source.joints is not None and not source.effort:
        notes.append("joint states are paired with the voltage by their stamps")
    if source.effort and source.said and not reading.units and "input_unit" not in bag.custom:
        per = "/s" if source.output == "velocity" else ""
        usual = f"effort is taken as V and {source.output} as m{per}"
        notes.append(f'joint states name no unit: {usual}; otherwise give for example --unit input="N m",output=rad{per}')
    if source.effort and not source.said:
        notes.append(f"joint states name no unit; effort and {source.output} are carried as they are")
    paired = cut(pair(streams, str(path), units(bag, source), notes, bag.bad), first, start, stop)
    if source.output == "velocity":
        paired = dataclasses.replace(paired, measured="velocity", output_unit=paired.units.speed)
    return in_units(dataclasses.replace(paired, machine=bag.custom.get("machine", "")), reading)


def _collect(
    bag: Bag, blocks: Iterator[tuple[StreamName, Block]], start: float, stop: float | None
) -> tuple[dict[StreamName, list[Block]], dict[StreamName, float]]:
    """The blocks of the requested part, and the first instant of each kind. Raises BadRecording if they do not fit in memory."""
    kept: dict[StreamName, list[Block]] = {}
    first: dict[StreamName, float] = {}
    latest: dict[StreamName, float] = {}
    over: set[StreamName] = set()
    restarted, size = False, 0
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
                if over.issuperset(KINDS):
                    break
                continue
            inside = ~((elapsed < start - MARGIN) | (elapsed > (np.inf if stop is None else stop + MARGIN)))
            block = Block(block.axes, block.seq[inside], block.time[inside], block.values[inside])
        kept.setdefault(kind, []).append(block)
        size += size_of(block)
        check_room(bag, size)
    return kept, first


def size_of(block: Block) -> int:
    """Bytes of a block's samples."""
    return block.values.nbytes + block.seq.nbytes + block.time.nbytes


def check_room(bag: Bag, size: int) -> None:
    """Raises BadRecording if the memory has no room for this many bytes of samples."""
    if size > room():
        raise bag.bad(f"more than {size / 1e9:.1f} GB of samples, too long to load at once", "Give a part with --span, or replay it.")


def _axes(
    bag: Bag, kept: dict[StreamName, list[Block]], wanted: Sequence[str] | None, joints: bool, notes: list[str]
) -> tuple[dict[StreamName, list[Block]], tuple[str, ...]]:
    """Blocks that have the axes to be read, and these axes; raises BadRecording if there are none in common."""
    names: dict[StreamName, tuple[str, ...]] = {kind: _usual(blocks) for kind, blocks in kept.items()}
    same: dict[StreamName, list[Block]] = {kind: [block for block in blocks if block.axes == names[kind]] for kind, blocks in kept.items()}
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
    if not set(common) <= set(names.get("reference", common)):
        notes.append(
            f"the reference has {', '.join(names['reference'])} and the axes are {', '.join(common)}: use --joint AXIS=JOINT; it is left out"
        )
        del same["reference"]
    if wanted is None:
        return same, common
    unknown = [name for name in wanted if name not in common]
    if unknown:
        raise BadInput("axis", ", ".join(unknown), ", ".join(common), "Choose some of these.")
    return same, tuple(wanted)


def _usual(blocks: Sequence[Block]) -> tuple[str, ...]:
    """The columns of most samples, so that single wrong messages do not matter."""
    counts: dict[tuple[str, ...], int] = {}
    for block in blocks:
        counts[block.axes] = counts.get(block.axes, 0) + len(block)
    return max(counts, key=lambda axes: counts[axes])


def _empty(blocks: dict[StreamName, list[Block]]) -> set[str]:
    """The axes that have hardly any numbers."""
    empty: set[str] = set()
    for kind in ("voltage", "position"):
        values = [block.values for block in blocks[kind]]
        if all(np.isfinite(one).all() for one in values):
            continue
        empty |= {axis for axis, none in zip(blocks[kind][0].axes, hollow(np.concatenate(values)), strict=True) if none}
    return empty


def _by_stamp(stream: Stream, by: Stream) -> Stream:
    """Give each sample the number of the closest sample in time of another stream; each number is used once."""
    order = np.argsort(by.time, kind="stable")
    times, numbers = by.time[order], by.seq[order]
    after = np.clip(np.searchsorted(times, stream.time), 1, len(times) - 1) if len(times) > 1 else np.zeros(len(stream.time), dtype=np.int64)
    nearest = np.where(stream.time - times[after - 1] < times[after] - stream.time, after - 1, after) if len(times) > 1 else after
    seq, first = np.unique(numbers[nearest], return_index=True)
    return Stream(stream.axes, seq, times[nearest][first], stream.values[first])


def topics(reading: Reading) -> Topics:
    """The topics to read, from the options."""
    return Topics(
        voltage_topic=reading.voltage_topic,
        position_topic=reading.position_topic,
        joint_topic=reading.joint_topic,
        effort_as_voltage=reading.effort_as_voltage,
        joints=tuple(reading.joints),
        effort_lag=reading.effort_lag,
        output="velocity" if reading.velocity else None,
    )


def _in_order(path: Path, streams: dict[str, Stream], lag: int, notes: list[str]) -> dict[str, Stream]:
    """Positions and efforts of one stream of joint states, resampled by their stamps if the period drifts, as in a table of uneven time.

    If stamps only jitter too much to be counted, samples are numbered as they came. Empty if neither applies. lag: samples by which efforts are older
    """
    position, voltage = streams["position"], streams["voltage"]
    time, both = position.time, len(voltage.seq)
    if len(time) < 2 or both != len(time) - lag:
        return {}
    if drifts(time):
        try:
            found = even(path, time[:both], voltage.values, (position.values[:both],), notes)
        except BadRecording as problem:
            notes.append(f"{problem.problem}; samples are numbered by their steps all the same")
        else:
            values = zip(("voltage", "position"), found.values, strict=True)
            return {name: Stream(streams[name].axes, found.seq, found.time, numbers) for name, numbers in values}
    if not is_jitter(np.diff(position.seq)):
        return {}
    notes.append("the stamps jitter by more than half a sample; samples are numbered as they came, with even times")
    count, instants = np.arange(len(time), dtype=np.float64), steady(time)
    return {
        "position": Stream(position.axes, count, instants, position.values),
        "voltage": Stream(voltage.axes, count[:both], instants[:both], voltage.values),
    }
