"""A bag of any length as blocks of voltage and position, in log order and with constant memory."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from xy_sysid.bags.cdr import ARRAY_TYPE, JOINT_TYPE, Layout, array_layout, joint_layout
from xy_sysid.bags.reading import Bag
from xy_sysid.bags.stride import Batch, Indices, Reader, Stretch, doubles, stamps
from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.samples.block import Block, FloatArray, StreamName, unpack
from xy_sysid.samples.integral import Path as Moved
from xy_sysid.samples.integral import integrated
from xy_sysid.samples.joint_fields import FIELDS, PLURAL, JointOutput, joints_of
from xy_sysid.samples.joint_states import JointCounter
from xy_sysid.units import Units

VOLTAGE, POSITION, REFERENCE = "/xy/voltage", "/xy/position", "/xy/reference"
PIECE = 2000  # samples of a block; the buffers that pair samples hold sixteen times as many
AFTER_ODD = 2  # messages that come one by one after a counter that went back, until the pairing has decided on its cause
CLOCK_SAMPLES = 2000  # stamps from which the period of a joint state stream is computed
EFFORT_UNITS = Units("effort", "position")  # joint states have no unit: N m or N, rad or m
OTHERS = "Name others with --topic voltage=NAME, position=NAME or joints=NAME."


@dataclass(frozen=True, slots=True)
class Topics:
    """What to read from a bag: block topics of input and output, the JointState topic (found if it is the only one), and its effort as input.

    output: field of the joint states that is the output; None: the position, or the velocity if no joint has a position
    joints: the joint of each axis, as x=shoulder_pan_joint; empty: every joint is an axis of its name
    effort_lag: age of the effort relative to its stamp, samples
    """

    voltage_topic: str = VOLTAGE
    position_topic: str = POSITION
    joint_topic: str | None = None
    effort_as_voltage: bool = False
    joints: tuple[str, ...] = ()
    effort_lag: int = 0
    output: JointOutput | None = None


USUAL = Topics()


@dataclass(frozen=True, slots=True)
class Source:
    """Source of input and output.

    topics: (name, kind) of the block topics; joints: the JointState topic or None; effort: True if its effort is the input; output: its field
    said:   True if the user chose effort; False if it was the only input found
    axes:   axis of each joint that is read; empty: all, under their own names; lag: age of the effort, samples
    """

    topics: tuple[tuple[str, StreamName], ...]
    joints: str | None
    effort: bool
    said: bool
    axes: Mapping[str, str] = field(default_factory=dict)
    lag: int = 0
    output: JointOutput = "position"


def choose(bag: Bag, topics: Topics) -> Source:
    """Decide which topics to read; raises BadRecording, which lists the bag's topics."""
    voltage_topic, position_topic, effort_as_voltage = topics.voltage_topic, topics.position_topic, topics.effort_as_voltage
    blocks = [name for name in (voltage_topic, position_topic) if bag.kind(name) == ARRAY_TYPE]
    joints = topics.joint_topic
    if joints is None and bag.kind(position_topic) == JOINT_TYPE:
        joints = position_topic
    elif joints is None and (position_topic not in blocks or effort_as_voltage):
        found = bag.of_kind(JOINT_TYPE)
        if len(found) > 1:
            raise bag.bad(f"has several JointState topics: {', '.join(found)}", "Choose one with --topic joints=NAME.")
        joints = found[0] if found else None
    extra: tuple[tuple[str, StreamName], ...] = ((REFERENCE, "reference"),) if bag.kind(REFERENCE) == ARRAY_TYPE else ()
    if joints is not None:
        if bag.kind(joints) != JOINT_TYPE:
            raise bag.bad(f"has no JointState topic {joints}; it has {bag.listing()}", OTHERS)
        effort = effort_as_voltage or voltage_topic not in blocks
        inputs: tuple[tuple[str, StreamName], ...] = () if effort else ((voltage_topic, "voltage"),)
        names = tuple(pair.partition("=")[0].strip() for pair in topics.joints)
        axes = {joint: axis for axis, joint in joints_of(names, topics.joints).items()}
        return Source(
            topics=(*inputs, *extra),
            joints=joints,
            effort=effort,
            said=effort_as_voltage,
            axes=axes,
            lag=topics.effort_lag,
            output=topics.output or _given(bag, joints, list(axes)),
        )
    if len(blocks) < 2:
        missing = " and ".join(dict.fromkeys(name for name in (voltage_topic, position_topic) if name not in blocks))
        raise bag.bad(f"no block topic {missing}; it has {bag.listing()}", OTHERS)
    return Source(((voltage_topic, "voltage"), (position_topic, "position"), *extra), None, False, False)


def _given(bag: Bag, topic: str, joints: Sequence[str]) -> JointOutput:
    """Velocity, with a note, if none of these joints (empty: all) has a position in the whole bag, and one has a velocity; otherwise position."""
    reader, moving, said = Reader(joint_layout), False, len(bag.notes)
    for batch, _ in bag.batches([topic]):
        for stretch in reader.stretches(batch):
            names = stretch.layout.names if stretch.layout is not None else ()
            columns = [place for place, name in enumerate(names) if name in joints or not joints]
            known = [_any_numbers(batch, stretch, field, columns) for field in (0, 1)]
            if known[0]:
                del bag.notes[said:]
                return "position"
            moving |= known[1]
    del bag.notes[said:]
    if moving:
        bag.notes.append(f"{topic} gives no positions; the velocity of the joints is the output")
    return "velocity" if moving else "position"


def _any_numbers(batch: Batch, stretch: Stretch, field: int, columns: list[int]) -> bool:
    """True if any of these joints has a finite number in one of the messages."""
    layout = stretch.layout
    if layout is None or not columns or layout.parts[field][1] != len(layout.names):
        return False
    return bool(np.isfinite(doubles(batch, stretch, field)[:, columns]).any())


def units(bag: Bag, source: Source) -> Units:
    """Units of input and position, from the bag."""
    if source.effort and not source.said:
        return EFFORT_UNITS
    return Units(bag.custom.get("input_unit", "V"), bag.custom.get("output_unit", "m"))


class _Clock:
    """Sample numbers for stamps: periods since the previous stamp, or since the last voltage sample before each."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.seq, self.time = np.empty(0), np.empty(0)

    def forget(self) -> None:
        """Keep the newest anchor only."""
        self.seq, self.time = self.seq[-1:], self.time[-1:]

    def anchor(self, block: Block) -> None:
        """Add samples whose number and time are known."""
        finite = np.isfinite(block.time) & np.isfinite(block.seq)
        seq, time = np.append(self.seq, block.seq[finite]), np.append(self.time, block.time[finite])
        order = np.argsort(time, kind="stable")
        self.seq, self.time = seq[order], time[order]

    def near(self, time: FloatArray) -> FloatArray:
        """(n,) sample numbers of stamps relative to the anchors; NaN without an anchor."""
        if not self.time.size:
            return np.full(len(time), np.nan)
        place = np.maximum(np.searchsorted(self.time, time, side="right") - 1, 0)
        return np.asarray(self.seq[place] + np.rint((time - self.time[place]) / self.period))

    def follow(self, time: FloatArray) -> FloatArray:
        """(n,) sample numbers of stamps from their own steps, starting at 0."""
        before, number = (self.time[-1], self.seq[-1]) if self.time.size else (time[0], 0.0)
        seq = number + np.cumsum(np.rint(np.diff(time, prepend=before) / self.period))
        self.seq, self.time = seq[-1:], time[-1:]
        return np.asarray(seq)


@dataclass(frozen=True, slots=True)
class _Part:
    """Decoded messages of one kind: ``message`` is the index of each in the batch, ``rows`` its number of samples."""

    kind: StreamName
    message: Indices
    rows: int
    block: Block


class _Decoder:
    """Converts batches of raw messages to blocks, and counts unreadable messages."""

    def __init__(self, bag: Bag, source: Source, live: bool = False) -> None:
        """live: number joint states with effort one by one as the nodes do, without later data."""
        self.bag, self.source, self.live = bag, source, live
        self.counter: JointCounter | None = None
        self.names = [name for name, _ in source.topics] + ([source.joints] if source.joints else [])
        self.readers = [Reader(array_layout) for _ in source.topics] + [Reader(joint_layout)]
        self.unreadable: dict[str, int] = {}
        self.example: dict[str, str] = {}
        self.repeated: dict[str, tuple[str, ...]] = {}
        self.joints: tuple[str, ...] = ()
        self.from_log: bool | None = None
        self.clock: _Clock | None = None
        self.moved: Moved | None = None  # live: velocities become positions here; otherwise after all data have been read

    def parts(self, batch: Batch) -> list[_Part]:
        parts: list[_Part] = []
        if self.clock is not None:
            self.clock.forget()
        for index, name in enumerate(self.names):
            message = np.flatnonzero(batch.topic == index)
            if not message.size:
                continue
            mine = Batch(
                topic=batch.topic[message],
                log_time=batch.log_time[message],
                start=batch.start[message],
                length=batch.length[message],
                buffer=batch.buffer,
            )
            for stretch in self.readers[index].stretches(mine):
                places = message[stretch.first : stretch.last]
                if stretch.layout is None:
                    self.skip(name, len(places), "not a message of its type")
                elif index < len(self.source.topics):
                    parts += self.blocks(name, self.source.topics[index][1], mine, stretch, stretch.layout, places)
                else:
                    parts += self.joint_states(name, mine, stretch, stretch.layout, places)
        return parts

    def skip(self, name: str, count: int, why: str) -> None:
        self.unreadable[name] = self.unreadable.get(name, 0) + count
        self.example.setdefault(name, why)

    def blocks(self, name: str, kind: StreamName, batch: Batch, stretch: Stretch, layout: Layout, places: Indices) -> list[_Part]:
        table = doubles(batch, stretch, 0)
        try:
            if len(layout.names) != 2:
                raise BadInput("dimensions", len(layout.names), "2", "Name the columns in layout.dim[1].label.")
            label, rows, width = layout.names[1], layout.shape[0], layout.shape[1]
            label, width, table = self.once(name, label, rows, width, table)
            unpack(label, rows, width, table[0])
        except BadInput as error:
            self.skip(name, len(places), str(error))
            return []
        block = unpack(label, len(table) * rows, width, table.ravel())
        if not len(block):
            return []
        if self.clock is not None and kind == "voltage":
            self.clock.anchor(block)
        return [_Part(kind, places, layout.shape[0], block)]

    def once(self, name: str, label: str, rows: int, width: int, table: FloatArray) -> tuple[str, int, FloatArray]:
        """Label, width and numbers without the columns whose names occur twice, because they are ambiguous."""
        names = [word.strip() for word in label.split(",")]
        kept = [place for place, word in enumerate(names) if names.count(word) == 1]
        if len(kept) == len(names) or len(names) != width or rows * width != table.shape[1] or names[:2] != ["seq", "time"]:
            return label, width, table
        self.repeated.setdefault(name, tuple(dict.fromkeys(word for word in names if names.count(word) > 1)))
        left = table.reshape(len(table), rows, width)[:, :, kept]
        return ",".join(names[place] for place in kept), len(kept), left.reshape(len(table), -1)

    def joint_states(self, name: str, batch: Batch, stretch: Stretch, layout: Layout, places: Indices) -> list[_Part]:
        single = tuple(joint for joint in layout.names if layout.names.count(joint) == 1)
        if len(single) < len(layout.names):
            self.repeated.setdefault(name, tuple(dict.fromkeys(joint for joint in layout.names if joint not in single)))
        wanted = self.source.axes
        lacking = [joint for joint in wanted if joint not in single]
        if lacking:
            self.skip(name, len(places), f"no joint {', '.join(lacking)} among {', '.join(layout.names)}")
            return []
        if wanted:
            single = tuple(wanted)
        self.joints = self.joints or single
        field = FIELDS.index(self.source.output)
        number, effort = layout.parts[field][1], layout.parts[2][1]
        width = len(layout.names)
        if number != width or not single or set(single) != set(self.joints) or (self.source.effort and effort != width):
            what = f"{width} names with {number} {PLURAL[self.source.output]} and {effort} efforts"
            self.skip(name, len(places), f"{what}, joints {', '.join(layout.names)}")
            return []
        stamp = stamps(batch, stretch)
        if self.from_log is None:
            self.from_log = not bool(np.any(stamp))
        time = (batch.log_time[stretch.first : stretch.last] if self.from_log else stamp).astype(np.float64) * 1e-9
        order = [layout.names.index(joint) for joint in self.joints]
        axes = tuple(wanted[joint] for joint in self.joints) if wanted else self.joints
        if self.live and self.source.effort:
            return self.counted(axes, places, time, np.hstack((doubles(batch, stretch, field)[:, order], doubles(batch, stretch, 2)[:, order])))
        seq = np.zeros(len(time)) if self.clock is None else self.clock.follow(time) if self.source.effort else self.clock.near(time)
        values = doubles(batch, stretch, field)[:, order]
        if self.live and self.source.output == "velocity" and self.clock is not None:
            self.moved = self.moved or Moved(len(axes))
            values = self.moved.add(seq, values, self.clock.period)
        parts = [_Part("position", places, 1, Block(axes, seq, time, values))]
        if self.source.effort:
            lag = self.source.lag if self.clock is not None else 0  # before the period is known, counters carry no information
            known, since = seq >= lag, lag * self.clock.period if self.clock is not None else 0.0
            efforts = Block(axes, seq[known] - lag, time[known] - since, doubles(batch, stretch, 2)[known][:, order])
            parts.insert(0, _Part("voltage", places[known], 1, efforts))
        return [part for part in parts if len(part.block)]

    def counted(self, axes: tuple[str, ...], places: Indices, time: FloatArray, rows: FloatArray) -> list[_Part]:
        """Positions and efforts with their numbers of live operation; a sample that was decided late comes at the time of the decision."""
        self.counter = self.counter or JointCounter(axes, with_voltage=False, output=self.source.output)
        block, index = self.counter.feed(time, rows)
        message, seq, even, values = places[index], block.seq, block.time, block.values
        known, lag, width = seq >= self.source.lag, self.source.lag, len(axes)
        efforts = Block(axes, seq[known] - lag, even[known], values[known, width:])
        parts = [_Part("position", message, 1, Block(axes, seq, even, values[:, :width])), _Part("voltage", message[known], 1, efforts)]
        return [part for part in parts if len(part.block)]

    def finish(self) -> None:
        for name, count in self.unreadable.items():
            self.bag.notes.append(f"{count} messages on {name} are left out: {self.example[name]}")
        for name, words in self.repeated.items():
            self.bag.notes.append(f"{name} has {', '.join(words)} twice, so it is not clear which is meant; they are left out")
        if self.from_log:
            self.bag.notes.append("the stamps of the joint states are zero; the time of recording is used")
        if self.live and self.source.output == "velocity":
            self.bag.notes.append(integrated())


@compiled
def _highest(level: Indices, samples: Indices) -> None:
    """Raise each ``level[i]`` to the sum of the samples before it."""
    before = 0
    for message in range(level.shape[0]):
        level[message] = max(level[message], before)
        before += samples[message]


@compiled
def _starts(seq: FloatArray, rows: int, before: float, group: Indices) -> Indices:
    """Messages that begin a block: where the group changes, and where the counter does not increase.

    The latter come one by one, as in live operation, so that an anomaly of one is not attributed to others.
    before: the counter before the first
    """
    found = np.empty(group.shape[0], np.int64)
    count, alone = 0, 0
    for message in range(group.shape[0]):
        odd = False
        for i in range(message * rows, (message + 1) * rows):
            odd |= not seq[i] > before
            before = seq[i]
        if odd:
            alone = message + 1 + AFTER_ODD
        if message < alone or message == 0 or group[message] != group[message - 1]:
            found[count] = message
            count += 1
    return found[:count]


def _cut(parts: list[_Part], most: int, newest: dict[StreamName, float]) -> Iterator[tuple[StreamName, Block]]:
    """Blocks of about ``most`` samples, alternating between kinds, in log order. newest: last counter of each kind so far."""
    if not parts:
        return
    last = 1 + max(int(part.message[-1]) for part in parts)
    level = np.zeros(last, np.int64)
    for kind in {part.kind for part in parts}:
        samples = np.zeros(last, np.int64)
        for part in parts:
            if part.kind == kind:
                samples[part.message] = part.rows
        _highest(level, samples)
    level //= most
    pieces: list[tuple[int, int, int, int, int]] = []  # group, first message, part, first and last sample
    for index, part in enumerate(parts):
        group = level[part.message]
        starts = _starts(part.block.seq, part.rows, newest.get(part.kind, -np.inf), group)
        newest[part.kind] = float(part.block.seq[-1])
        edges = [*(starts * part.rows).tolist(), len(part.block)]
        pieces += zip(group[starts].tolist(), part.message[starts].tolist(), itertools.repeat(index), edges, edges[1:], strict=False)
    pieces.sort()
    for _, _, index, first, final in pieces:
        yield parts[index].kind, parts[index].block.rows(first, final)


def _period(bag: Bag, source: Source) -> float:
    """Sample period of the stream that numbers the joint states, s."""
    decoder = _Decoder(bag, source)
    times: list[FloatArray] = []
    seqs: list[FloatArray] = []
    for batch, _ in bag.batches(decoder.names):
        for part in decoder.parts(batch):
            if part.kind == "voltage":
                times.append(part.block.time)
                seqs.append(part.block.seq)
        if sum(map(len, times)) >= CLOCK_SAMPLES:
            break
    if not times or sum(map(len, times)) < 2:
        input_name = "effort" if source.effort else source.topics[0][0]
        why = "; ".join(decoder.example.values())
        act = OTHERS if source.effort else "Record for longer."
        raise bag.bad(f"fewer than 2 samples of {input_name} that can be read{f' ({why})' if why else ''}; it has {bag.listing()}", act)
    time, seq = np.concatenate(times), np.concatenate(seqs)
    lag = 1 if source.effort else max(1, len(time) // 2)  # with known numbers, a large distance gives many digits
    steps, counts = time[lag:] - time[:-lag], np.ones(1) if source.effort else seq[lag:] - seq[:-lag]
    steps, counts = np.broadcast_arrays(steps, counts)
    usable = (steps > 0) & (counts > 0)
    if not usable.any():
        raise bag.bad("the time stamps do not increase", "Record with stamped messages.")
    return float(np.median(steps[usable] / counts[usable]))


def pieces(bag: Bag, source: Source, most: int, progress: Callable[[float], None] | None, live: bool = False) -> Iterator[tuple[StreamName, Block]]:
    """The blocks of an open bag; notes on omitted data are added to ``bag.notes`` at the end.

    live: number joint states as a node would, without later data
    """
    decoder = _Decoder(bag, source, live)
    if source.joints is not None and not (live and source.effort):
        before = len(bag.notes)
        decoder.clock = _Clock(_period(bag, source))
        del bag.notes[before:]
    newest: dict[StreamName, float] = {}
    for batch, part in bag.batches(decoder.names):
        yield from _cut(decoder.parts(batch), most, newest)
        if progress is not None:
            progress(part)
    decoder.finish()


def stream_blocks(
    path: Path | str,
    topics: Topics = USUAL,
    *,
    chunk_samples: int = PIECE,
    notes: list[str] | None = None,
    progress: Callable[[float], None] | None = None,
    about: Callable[[Units], None] | None = None,
) -> Iterator[tuple[StreamName, Block]]:
    """("voltage" | "position" | "reference", Block) in log order, with constant memory.

    chunk_samples: approximate number of samples in a block, and so the largest offset between the kinds
    notes:         receives a sentence for each anomaly or omission; complete when the iteration has ended
    progress:      called with the fraction that has been read, 0..1
    about:         called with the units of input and output before the first block
    Raises BadRecording if nothing can be read.
    """
    with Bag(path) as bag:
        try:
            source = choose(bag, topics)
            if about is not None:
                about(units(bag, source))
            yield from pieces(bag, source, chunk_samples, progress, live=True)
        finally:
            if notes is not None:
                notes.extend(bag.notes)
