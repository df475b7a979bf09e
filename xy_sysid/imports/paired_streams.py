"""Two streams of samples --> one Recording: paired by sample number, sorted, without repeated samples and without NaN."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.clock import disagreements, steps
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.recording import SAME_RATE, Recording, rate_from_time

LATE = 0.5  # s; a sample number that stays back further is a restart of the source
FEW = 0.01  # of the samples; if more steps are off their grid in both directions, they are jitter, not gaps
STEPS = 100_000  # most time steps for the period; of a longer stream every second, third, ... is used
LARGEST = 2.0**53  # larger counters are not exact in a double, so they are not used
LARGEST_VALUE = 1e100  # of a signal: its square must be finite
HOLLOW = 0.5  # of the samples; an axis without numbers in more is left out, instead of these samples
Fail = Callable[[str, str], BadRecording]
Rows = NDArray[np.int64] | slice


@dataclass(frozen=True, slots=True)
class Stream:
    """All samples of one kind in log order: seq (n,), time (n,) s, values (n, axes)."""

    axes: tuple[str, ...]
    seq: FloatArray
    time: FloatArray
    values: FloatArray


def is_jitter(steps: FloatArray) -> bool:
    """Whether time steps, in whole periods, differ from 1 because instants jitter: then short and long steps balance."""
    short, extra = float(np.sum(np.maximum(1 - steps, 0))), float(np.sum(np.maximum(steps - 1, 0)))
    return short + extra > FEW * len(steps) and short < 2 * extra < 4 * short


def steady(time: FloatArray) -> FloatArray:
    """(n,) s, evenly spaced instants fitted to jittering ones."""
    count = np.arange(len(time)) - (len(time) - 1) / 2
    return np.asarray(time.mean() + count * (count @ (time - time.mean())) / (count @ count))


def sane(values: FloatArray) -> NDArray[np.bool_]:
    """(n,) rows whose numbers can be squared; if most are too large, the unit is wrong and not single samples: then all finite rows."""
    finite = np.isfinite(values).all(axis=1)
    with np.errstate(invalid="ignore"):
        small = (np.abs(values) <= LARGEST_VALUE).all(axis=1)
    return np.asarray(small if 2 * np.sum(small) > np.sum(finite) else finite)


def hollow(values: FloatArray) -> NDArray[np.bool_]:
    """(axes,) whether an axis has hardly any numbers, so that it is left out instead of its rows."""
    return np.asarray(np.mean(~np.isfinite(values), axis=0) > HOLLOW) if len(values) else np.zeros(values.shape[1], np.bool_)


def filled(axes: Sequence[str], empty: Sequence[bool], notes: list[str]) -> list[int]:
    """Places of the axes that have numbers, all if none has any; those that are left out are added to ``notes``."""
    left = [axis for axis, none in zip(axes, empty, strict=True) if none]
    if len(left) in (0, len(axes)):
        return list(range(len(axes)))
    notes.append(f"axis {', '.join(left)} has hardly any numbers; it is left out")
    return [place for place, none in enumerate(empty) if not none]


def gather(name: str, blocks: Sequence[Block], axes: tuple[str, ...], notes: list[str], fail: Fail) -> Stream:
    """One stream from blocks, with the columns in the order of ``axes``; rows that are not finite become gaps."""
    size, end = sum(map(len, blocks)), 0
    seq, time, values = np.empty(size), np.empty(size), np.empty((size, len(axes)))
    for block in blocks:
        rows = slice(end, end + len(block))
        seq[rows], time[rows] = block.seq, block.time
        values[rows] = block.values if block.axes == axes else block.values[:, [block.axes.index(axis) for axis in axes]]
        end = rows.stop
    np.rint(seq, out=seq)
    finite = np.isfinite(time) & sane(values) & (np.abs(seq) < LARGEST)
    if not finite.all():
        notes.append(f"{int(np.sum(~finite))} rows of {name} are not numbers; they are left out")
        seq, time, values = seq[finite], time[finite], values[finite]
    if not len(seq):
        raise fail(f"no samples of {name}", "Record while the source publishes.")
    return Stream(axes, seq, time, values)


def sessions(seq: FloatArray, tolerance: float) -> list[int]:
    """Restarts of the source's counter: first index of each session, 0 included.

    A number that falls back by more than ``tolerance`` begins a session, unless the old numbers soon continue: then it was a
    late sample, which sorting corrects.
    """
    starts = [0]
    if bool(np.all(seq[1:] > seq[:-1])):
        return starts
    while True:
        part = seq[starts[-1] :]
        highest = np.maximum.accumulate(part)
        fallen = np.flatnonzero(part < highest - tolerance)
        begin = 0
        for index in fallen[np.flatnonzero(np.diff(fallen, prepend=-2) > 1)].tolist():
            back = np.flatnonzero(part[index:] > highest[index] - tolerance)
            ends_soon = len(part) - index <= tolerance < part[index]  # a late block at the end, not a restart
            if back[0] > tolerance if back.size else not ends_soon:
                begin = index
                break
        if begin == 0:
            return starts
        starts.append(starts[-1] + begin)


def _steps(stream: Stream) -> FloatArray:
    """Time steps from one sample number to the next."""
    at = np.arange(1, len(stream.seq), 1 + len(stream.seq) // STEPS)
    return np.asarray((stream.time[at] - stream.time[at - 1])[stream.seq[at] - stream.seq[at - 1] == 1])


def _merge(streams: dict[str, Stream], notes: list[str]) -> tuple[dict[str, Stream], float]:
    """The streams with numbers and times of each session after those of the session before; and the sampling period, s."""
    steps = np.concatenate([_steps(stream) for stream in streams.values()])
    period = float(np.median(steps)) if len(steps) else 0.0
    tolerance = LATE / period if period > 0 else 1000.0
    starts = {name: sessions(stream.seq, tolerance) for name, stream in streams.items()}
    counts = {name: len(found) for name, found in starts.items()}
    most = max(counts.values())
    if most == 1:
        return streams, period
    kept = min(counts.values())
    if kept == most:
        notes.append(f"the source restarted {most - 1} times; the parts are joined with a gap between them")
    else:
        said = ", ".join(f"{name} {count - 1} times" for name, count in counts.items())
        notes.append(f"the sample counters restarted a different number of times ({said}); only the part before the first is paired")
        kept = 1
    merged: dict[str, list[Stream]] = {name: [] for name in streams}
    offset, late = 0.0, 0.0
    for number in range(kept):
        highest, latest = -np.inf, -np.inf
        parts: dict[str, Stream] = {}
        for name, stream in streams.items():
            edges = [*starts[name], len(stream.seq)]
            rows = slice(edges[number], edges[number + 1])
            parts[name] = Stream(stream.axes, stream.seq[rows], stream.time[rows], stream.values[rows])
        lowest = min(float(part.seq.min()) for part in parts.values())
        earliest = min(float(part.time.min()) for part in parts.values())
        for name, part in parts.items():
            shift, delay = (offset - lowest, late - earliest) if number else (0.0, 0.0)
            moved = Stream(part.axes, part.seq + shift, part.time + delay, part.values)
            highest, latest = max(highest, float(moved.seq.max())), max(latest, float(moved.time.max()))
            merged[name].append(moved)
        offset, late = highest + 2, latest + 2 * period
    return {
        name: Stream(
            parts[0].axes,
            np.concatenate([part.seq for part in parts]),
            np.concatenate([part.time for part in parts]),
            np.concatenate([part.values for part in parts]),
        )
        for name, parts in merged.items()
    }, period


def _sorted(name: str, stream: Stream, notes: list[str]) -> Stream:
    """The stream in the order of seq; of samples with the same number the first is kept."""
    if not bool(np.all(np.diff(stream.seq) > 0)):
        order = np.argsort(stream.seq, kind="stable")
        seq = stream.seq[order]
        first = np.concatenate(([True], np.diff(seq) > 0))
        if not bool(np.all(np.diff(stream.seq) >= 0)):
            notes.append(f"{name} came out of order; it is sorted")
        if not first.all():
            notes.append(f"{int(np.sum(~first))} samples of {name} are there twice; the first is kept")
        order = order[first]
        return Stream(stream.axes, stream.seq[order], stream.time[order], stream.values[order])
    return stream


def pair(streams: dict[str, Stream], source: str, units: tuple[str, str], notes: list[str], fail: Fail) -> Recording:
    """The recording of the samples that "voltage" and "position" share, with "reference" if it covers them all.

    Raises the error of ``fail`` if nothing can be paired or if the streams have different rates.
    """
    streams, period = _merge(streams, notes)
    slips = _watched(streams, period, notes)
    streams = {name: _sorted(name, stream, notes) for name, stream in streams.items()}
    voltage, position = streams["voltage"], streams["position"]
    for name, stream in (("voltage", voltage), ("position", position)):
        if len(stream.seq) < 2:
            raise fail(f"only {len(stream.seq)} sample of {name}", "Record for longer.")
    rates = {name: _rate(name, stream, fail) for name, stream in (("voltage", voltage), ("position", position))}
    if abs(rates["voltage"] / rates["position"] - 1) > SAME_RATE:
        raise fail(f"voltage runs at {rates['voltage']:.6g} Hz and position at {rates['position']:.6g} Hz", "Record both at one rate.")
    seq, left, right = _common(voltage.seq, position.seq)
    if slips and len(seq) > 2:
        seq, left, right = _paired_alike(seq, (left, right), (voltage.time[left] - position.time[right]) / period, slips, notes)
    if len(seq) < 2:
        spans = f"voltage has {voltage.seq[0]:.0f} to {voltage.seq[-1]:.0f}, position {position.seq[0]:.0f} to {position.seq[-1]:.0f}"
        raise fail(f"no sample numbers in common ({spans})", "Give both topics the same counter, or stamps of one clock.")
    alone = {"voltage": len(voltage.seq) - len(seq), "position": len(position.seq) - len(seq)}
    notes += [f"{count} samples of {name} have no partner; they are left out" for name, count in alone.items() if count]
    apart = float(np.median(voltage.time[left] - position.time[right]))
    if period > 0 and abs(apart) > 0.1 * period:
        notes.append(f"samples of the same number are stamped {1e3 * abs(apart):.4g} ms apart; they are paired by number")
    reference = _reference(streams.get("reference"), seq, notes)
    whole = len(seq) == len(position.seq) and not slips
    return Recording(
        sampling_rate=rates["position"] if whole else rate_from_time(position.time[right], seq.astype(np.int64)),
        axes=position.axes,
        seq=seq.astype(np.int64),
        time=position.time[right],
        voltage=voltage.values[left],
        position=position.values[right],
        input_unit=units[0],
        output_unit=units[1],
        reference=reference,
        source=source,
        notes=tuple(notes),
    )


def _watched(streams: dict[str, Stream], period: float, notes: list[str]) -> list[float]:
    """The sample numbers at which only one counter slips; adds notes on differences between time and counter."""
    if period <= 0:
        return []
    slips: dict[str, set[float]] = {}
    for name in ("voltage", "position"):
        stream = streams[name]
        notes += disagreements(f"the {name}", stream.seq, stream.time, 1.0 / period)
        found = steps(stream.seq, stream.time, 1.0 / period)[1]
        slips[name] = {float(stream.seq[row]) - min(0, round(size)) for row, size in found}  # of repeated numbers the first are kept
    return sorted(slips["voltage"] ^ slips["position"])


def _paired_alike(
    seq: FloatArray, places: tuple[Rows, Rows], apart: FloatArray, slips: list[float], notes: list[str]
) -> tuple[FloatArray, Rows, Rows]:
    """The part between slips of one counter whose stamps agree best; of equal ones the longest.

    apart: (n,) periods by which the stamps of each pair differ
    """
    edges = np.unique(np.concatenate(([0], np.searchsorted(seq, slips), [len(seq)])))
    parts = list(itertools.pairwise(edges.tolist()))
    begin, end = min(parts, key=lambda part: (round(abs(float(np.median(apart[part[0] : part[1]])))), part[0] - part[1]))
    notes.append(
        f"samples before and after a slip of one counter alone are paired differently; the part whose stamps agree best is read, "
        f"{end - begin} of {len(seq)} samples from number {seq[begin]:.0f} on"
    )
    rows = np.arange(begin, end)
    left, right = (rows if isinstance(one, slice) else one[rows] for one in places)
    return seq[begin:end], left, right


def _common(one: FloatArray, other: FloatArray) -> tuple[FloatArray, Rows, Rows]:
    """Sample numbers that both have, and their rows; both are sorted and without repeated numbers."""
    if np.array_equal(one, other):
        return one, slice(None), slice(None)
    place = np.minimum(np.searchsorted(other, one), len(other) - 1)
    left = np.flatnonzero(other[place] == one)
    return one[left], left, place[left]


def _rate(name: str, stream: Stream, fail: Fail) -> float:
    try:
        return rate_from_time(stream.time, stream.seq.astype(np.int64))
    except BadInput:
        raise fail(f"the time of {name} does not increase", "Stamp each sample with its instant in seconds.") from None


def _reference(stream: Stream | None, seq: FloatArray, notes: list[str]) -> FloatArray | None:
    if stream is None:
        return None
    common, _, there = _common(seq, stream.seq)
    if len(common) < len(seq):
        notes.append("the reference does not cover all samples; it is left out")
        return None
    return stream.values[there]


def cut(recording: Recording, begin: float, start: float, stop: float | None) -> Recording:
    """The part from ``start`` to before ``stop``, s after the instant ``begin``; raises BadInput for fewer than 2 samples."""
    if start <= 0 and stop is None:
        return recording
    elapsed = recording.time - begin
    inside = (elapsed >= start - 1e-9) & (elapsed < (np.inf if stop is None else stop - 1e-9))
    if np.sum(inside) < 2:
        asked = f"{start:g} to {'the end' if stop is None else f'{stop:g}'} s"
        raise BadInput("start and stop", asked, f"within 0 to {elapsed[-1]:.6g} s", "Choose a longer part.")
    return recording.only(inside)
