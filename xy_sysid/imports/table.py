"""Columns read from a file without sample numbers --> Recording: what CSV, NPZ and MAT have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.clock import disagreements
from xy_sysid.imports.even import even
from xy_sysid.imports.foreign_units import Quantity
from xy_sysid.imports.paired_streams import LARGEST, cut, hollow, sane
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording, Sensed, rate_from_time

USUAL = ("x", "y", "z")
ONE_UNIT = "Give all axes of one kind the same unit, or choose axes of one unit with --axis."
APART = 0.1  # part of the rows; if more have an input and no output or the other way round, the two have stamps of their own


@dataclass(frozen=True, slots=True)
class Table:
    """What a file holds, in SI.

    time: (n,) s, or None with ``fs`` in Hz; seq: (n,) sample numbers if the file has them; values (n, axes) each
    measured: what ``output`` is
    """

    axes: tuple[str, ...]
    time: FloatArray | None
    fs: float | None
    seq: FloatArray | None
    input: FloatArray
    output: FloatArray
    reference: FloatArray | None
    input_unit: str
    output_unit: str
    measured: Quantity = "position"


def axis_names(count: int) -> tuple[str, ...]:
    """x, y, z, axis4, ..."""
    return tuple(USUAL[i] if i < len(USUAL) else f"axis{i + 1}" for i in range(count))


def recording(path: Path, table: Table, wanted: Sequence[str] | None, start: float, stop: float | None, notes: list[str]) -> Recording:
    """Check, number and cut; raises BadRecording or BadInput."""
    rows = len(table.input)
    lengths = {"input": rows, "output": len(table.output)} | ({} if table.time is None else {"time": len(table.time)})
    lengths |= {} if table.seq is None else {"seq": len(table.seq)}
    if len(set(lengths.values())) > 1:
        raise BadRecording(path, "lengths differ: " + ", ".join(f"{name} {count}" for name, count in lengths.items()), "Give one row per sample.")
    if table.time is None:
        if table.fs is None or not (np.isfinite(table.fs) and table.fs > 0):
            raise BadRecording(path, f"neither a time column nor a usable fs ({table.fs})", "Add t in seconds or fs in Hz, or give --rate.")
        time = (np.arange(rows) if table.seq is None else table.seq) / table.fs
        notes.append(f"there is no time; fs = {table.fs:g} Hz is taken")
    else:
        time = table.time
    columns = _whole(path, table, places_of(table.axes, wanted), notes)
    voltage, position = table.input[:, columns], table.output[:, columns]
    reference = None if table.reference is None else table.reference[:, columns]
    seq = np.arange(rows, dtype=np.float64) if table.seq is None else table.seq
    voltage, keep = _own_stamps(voltage, position, notes)
    finite = keep & np.isfinite(time) & sane(voltage) & sane(position) & (np.abs(seq) < LARGEST)
    if not finite.all():
        left_out = int(np.sum(keep & ~finite))
        if left_out:
            notes.append(f"{left_out} rows are not numbers; they are left out")
        seq, time, voltage, position = seq[finite], time[finite], voltage[finite], position[finite]
        reference = None if reference is None else reference[finite]
    if len(time) < 2:
        raise BadRecording(path, f"{len(time)} samples", "A recording needs 2 or more; record for longer.")
    first, rate = float(time[0]), 0.0
    if table.seq is None:
        smooth = (position,) if reference is None else (position, reference)
        if table.time is None:
            rate = float(table.fs or 0.0)
        else:
            evened = even(path, time, voltage, smooth, notes)
            seq, time, rate = evened.seq, evened.time, evened.rate
            voltage, position = evened.values[:2]
            reference = None if reference is None else evened.values[2]
    seq = np.rint(seq)
    fresh = np.concatenate(([True], seq[1:] > np.maximum.accumulate(seq)[:-1]))
    if not fresh.all():
        if table.seq is not None and bool(np.any(np.diff(seq) < 0)):
            raise BadRecording(path, "seq does not increase", "Sort the samples by seq.")
        notes.append(f"{int(np.sum(~fresh))} samples are there twice; the first is kept")
        seq, time, voltage, position = seq[fresh], time[fresh], voltage[fresh], position[fresh]
        reference = None if reference is None else reference[fresh]
    numbers = seq.astype(np.int64)
    if table.seq is not None:
        rate = table.fs if table.time is None and table.fs is not None else rate_from_time(time, numbers)
        notes += disagreements("the file", seq, time, rate)
    if table.time is not None and table.fs is not None and abs(table.fs / rate - 1) > 1e-3:
        notes.append(f"fs says {table.fs:g} Hz, the time stamps {rate:.6g} Hz; the stamps are taken")
    measured: Sensed = table.measured if table.measured in ("velocity", "acceleration") else "position"
    result = Recording(
        sampling_rate=rate,
        axes=tuple(table.axes[i] for i in columns),
        seq=numbers,
        time=time,
        voltage=np.ascontiguousarray(voltage),
        position=np.ascontiguousarray(position),
        input_unit=table.input_unit,
        output_unit=table.output_unit,
        reference=None if reference is None else np.ascontiguousarray(reference),
        source=str(path),
        notes=tuple(notes),
        measured=measured,
    )
    return cut(result, first, start, stop)


def _whole(path: Path, table: Table, columns: list[int], notes: list[str]) -> list[int]:
    """The axes without those that have hardly any numbers, as long as others have."""
    empty = hollow(table.output) | hollow(table.input if not _apart(table.input, table.output) else table.input[:0])
    left = [place for place in columns if empty[place]]
    if not left or len(left) == len(columns):
        return columns
    names = ", ".join(table.axes[place] for place in left)
    notes.append(f"axis {names} has hardly any numbers; it is left out")
    return [place for place in columns if place not in left]


def _own_stamps(voltage: FloatArray, position: FloatArray, notes: list[str]) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Where input and output stand in different rows, as each has stamps of its own: the held input in the rows of the output."""
    has_input, has_output = np.isfinite(voltage).all(axis=1), np.isfinite(position).all(axis=1)
    if not _apart(voltage, position):
        return voltage, np.ones(len(voltage), dtype=np.bool_)
    last = np.maximum.accumulate(np.where(has_input, np.arange(len(voltage)), -1))
    alone, outputs = int(np.sum(has_output & ~has_input)), int(np.sum(has_output))
    notes.append(f"input and output have rows of their own ({alone} of {outputs} outputs have no input): the input is held until its next row")
    return voltage[np.maximum(last, 0)], has_output & (last >= 0)


def _apart(voltage: FloatArray, position: FloatArray) -> bool:
    """Whether there are many rows with an output and no input, and others with an input and no output."""
    has_input, has_output = np.isfinite(voltage).any(axis=1), np.isfinite(position).any(axis=1)
    alone = int(np.sum(has_output & ~has_input)), int(np.sum(has_input & ~has_output))
    return alone[0] > APART * int(np.sum(has_output)) and alone[1] > 0 and int(np.sum(has_input)) > 1


def places_of(axes: tuple[str, ...], wanted: Sequence[str] | None) -> list[int]:
    """Places of the axes that are wanted, all for None; raises BadInput for one that is not there."""
    if wanted is None:
        return list(range(len(axes)))
    unknown = [name for name in wanted if name not in axes]
    if unknown:
        raise BadInput("axis", ", ".join(unknown), ", ".join(axes), "Choose some of these.")
    return [axes.index(name) for name in wanted]
