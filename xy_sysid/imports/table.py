"""Columns read from a file --> Recording: the common part of CSV, NPZ, MAT and the like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.clock import disagreements
from xy_sysid.imports.even import even
from xy_sysid.imports.foreign_units import Quantity
from xy_sysid.imports.motion import leaps, unwrapped, wraps
from xy_sysid.imports.paired_streams import LARGEST, cut, filled, hollow, sane
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording, rate_from_time
from xy_sysid.units import Sensed

USUAL = ("x", "y", "z")
ONE_UNIT = "Give all axes of one kind the same unit, or choose axes of one unit with --axis."


@dataclass(frozen=True, slots=True)
class Table:
    """The content of a file, in SI.

    time: (n,) s, or None with ``fs`` in Hz; seq: (n,) sample numbers if the file has them; input, output, reference: (n, axes)
    measured: quantity of ``output``; starts: first rows of stretches that do not continue the one before
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
    starts: tuple[int, ...] = ()


def axis_names(count: int) -> tuple[str, ...]:
    """x, y, z, axis4, ..."""
    return tuple(USUAL[i] if i < len(USUAL) else f"axis{i + 1}" for i in range(count))


@dataclass(frozen=True, slots=True)
class _Rows:
    """Samples during the conversion: time (n,) s, seq (n,) so far, values (n, axes); stretch: (n,) number of the stretch."""

    time: FloatArray
    seq: FloatArray
    voltage: FloatArray
    position: FloatArray
    reference: FloatArray | None
    stretch: FloatArray

    def only(self, rows: NDArray[np.bool_] | slice) -> _Rows:
        """Some of the rows."""
        reference = None if self.reference is None else self.reference[rows]
        kept = {name: getattr(self, name)[rows] for name in ("time", "seq", "voltage", "position", "stretch")}
        return _Rows(**kept, reference=reference)


def recording(path: Path, table: Table, reading: Reading, notes: list[str]) -> Recording:
    """The requested part of a table, checked and numbered; raises BadRecording or BadInput."""
    result, first = uncut(path, table, reading, notes)
    return cut(result, first, reading.start, reading.stop)


def uncut(path: Path, table: Table, reading: Reading, notes: list[str]) -> tuple[Recording, float]:
    """The whole table, checked and numbered, and the instant from which its parts count, s. Raises BadRecording or BadInput."""
    _same_length(path, table)
    time = _time(path, table)
    wanted, empty = places_of(table.axes, reading.axes), hollow(table.output) | hollow(table.input)
    columns = [wanted[place] for place in filled([table.axes[place] for place in wanted], [bool(empty[place]) for place in wanted], notes)]
    rows = _unwrapped(table, _finite(path, table, columns, time, notes), notes)
    first = float(rows.time[0])
    rows, rate = _numbered(path, table, rows, notes)
    measured: Sensed = table.measured if table.measured in ("velocity", "acceleration") else "position"
    result = Recording(
        sampling_rate=rate,
        axes=tuple(table.axes[i] for i in columns),
        seq=rows.seq.astype(np.int64),
        time=rows.time,
        voltage=np.ascontiguousarray(rows.voltage),
        position=np.ascontiguousarray(rows.position),
        input_unit=table.input_unit,
        output_unit=table.output_unit,
        reference=None if rows.reference is None else np.ascontiguousarray(rows.reference),
        source=str(path),
        notes=tuple(notes),
        measured=measured,
    )
    return result, first


def _same_length(path: Path, table: Table) -> None:
    lengths = {"input": len(table.input), "output": len(table.output)} | ({} if table.time is None else {"time": len(table.time)})
    lengths |= {} if table.seq is None else {"seq": len(table.seq)}
    if len(set(lengths.values())) > 1:
        raise BadRecording(path, "lengths differ: " + ", ".join(f"{name} {count}" for name, count in lengths.items()), "Give one row per sample.")


def as_they_stand(rate: float | None, unused: str | None) -> list[str]:
    """The note on samples whose instants are not read. rate: Hz, None if unknown; unused: name of the ignored time column."""
    if unused is not None:
        return [f"the samples are used as they are, {rate:g} Hz; the time {unused!r} is not used"]
    return [] if rate is None else [f"there is no time; fs = {rate:g} Hz is taken"]


def _time(path: Path, table: Table) -> FloatArray:
    """(n,) s of all rows; from the rate if no time is read."""
    if table.time is not None:
        return table.time
    if table.fs is None or not (np.isfinite(table.fs) and table.fs > 0):
        raise BadRecording(path, f"neither a time column nor a usable fs ({table.fs})", "Add t in seconds or fs in Hz, or give --rate.")
    return np.asarray((np.arange(len(table.input)) if table.seq is None else table.seq) / table.fs)


def _finite(path: Path, table: Table, columns: list[int], time: FloatArray, notes: list[str]) -> _Rows:
    """The rows that hold numbers."""
    voltage, position = table.input[:, columns], table.output[:, columns]
    reference = None if table.reference is None else table.reference[:, columns]
    seq = np.arange(len(time), dtype=np.float64) if table.seq is None else table.seq
    finite = np.isfinite(time) & sane(voltage) & sane(position) & (np.abs(seq) < LARGEST)
    left_out = int(np.sum(~finite))
    if left_out:
        notes.append(f"{left_out} rows are not numbers; they are left out")
    rows = _Rows(time=time, seq=seq, voltage=voltage, position=position, reference=reference, stretch=_stretches(table, time)).only(finite)
    if len(rows.time) < 2:
        raise BadRecording(path, f"{len(rows.time)} samples", "A recording needs 2 or more; record for longer.")
    return rows


def _unwrapped(table: Table, rows: _Rows, notes: list[str]) -> _Rows:
    """The rows with wrapped angles unwrapped, because a wrapped angle cannot be interpolated."""
    if table.measured != "position":
        return rows
    if table.output_unit != "rad":
        notes += dict.fromkeys(note for column in rows.position.T if (note := leaps(column, table.output_unit)))
        return rows
    turns = [wraps(column) for column in rows.position.T]
    if any(turns):
        notes.append(f"the output leaps by a whole turn {sum(turns)} times, as an angle that wraps; it is unwrapped")
    position = np.column_stack([np.unwrap(column) if count else column for column, count in zip(rows.position.T, turns, strict=True)])
    reference = rows.reference
    if reference is not None:
        reference = np.column_stack([unwrapped(one, column) for one, column in zip(reference.T, position.T, strict=True)])
    return replace(rows, position=position, reference=reference)


def _stretches(table: Table, time: FloatArray) -> FloatArray:
    """(n,) number of each row's stretch: from the table, or a new one each time that the clock restarts."""
    begins = np.zeros(len(time))
    if table.starts:
        starts = np.array([start for start in table.starts[1:] if start < len(time)], dtype=np.int64)
        np.add.at(begins, starts, 1.0)
    elif table.seq is None and len(time) > 1:
        begins[1:][(np.diff(time) < 0) & (time[1:] < float(time[0]) + 0.5 * abs(float(time[1] - time[0])))] = 1.0
    return np.asarray(np.cumsum(begins))


def _numbered(path: Path, table: Table, rows: _Rows, notes: list[str]) -> tuple[_Rows, float]:
    """The rows with sample numbers, each once, and the rate, Hz."""
    rate = 0.0
    if table.seq is None:
        stretches = int(rows.stretch[-1]) + 1
        if stretches > 1:
            notes.append(f"{stretches} stretches, one after the other with gaps between them")
        if table.time is None:
            rate = float(table.fs or 0.0)
            number = np.unique(rows.stretch, return_inverse=True)[1]
            rows = replace(rows, seq=rows.seq + number, time=rows.time + number / rate)
        else:
            rows, rate = _by_time(path, rows, notes)
    rows = _each_once(path, table, replace(rows, seq=np.rint(rows.seq)), notes)
    if table.seq is not None:
        rate = table.fs if table.time is None and table.fs is not None else rate_from_time(rows.time, rows.seq.astype(np.int64))
        notes += disagreements("the file", rows.seq, rows.time, rate)
    if table.time is not None and table.fs is not None and abs(table.fs / rate - 1) > 1e-3:
        notes.append(f"fs says {table.fs:g} Hz, the time stamps {rate:.6g} Hz; the stamps are taken")
    return rows, rate


def _by_time(path: Path, rows: _Rows, notes: list[str]) -> tuple[_Rows, float]:
    """The rows numbered by their instants; the time of a stretch that restarts continues after the one before."""
    time, number = rows.time.copy(), rows.stretch
    period = float(np.median(np.diff(time)))
    for begin in np.flatnonzero(np.diff(number)) + 1:
        if time[begin] <= time[begin - 1]:
            time[begin:] += time[begin - 1] - time[begin] + 2 * period
    smooth = (rows.position,) if rows.reference is None else (rows.position, rows.reference)
    found = even(path, time, rows.voltage, smooth, notes)
    reference = None if rows.reference is None else found.values[2]
    whole = np.zeros(len(found.seq))
    voltage, position = found.values[:2]
    return _Rows(time=found.time, seq=found.seq, voltage=voltage, position=position, reference=reference, stretch=whole), found.rate


def _each_once(path: Path, table: Table, rows: _Rows, notes: list[str]) -> _Rows:
    """The first of the rows with the same number. Raises BadRecording if the file's own numbers decrease."""
    fresh = np.concatenate(([True], rows.seq[1:] > np.maximum.accumulate(rows.seq)[:-1]))
    if fresh.all():
        return rows
    if table.seq is not None and bool(np.any(np.diff(rows.seq) < 0)):
        raise BadRecording(path, "seq does not increase", "Sort the samples by seq.")
    notes.append(f"{int(np.sum(~fresh))} samples are there twice; the first is kept")
    return rows.only(fresh)


def places_of(axes: tuple[str, ...], wanted: Sequence[str] | None) -> list[int]:
    """Indices of the wanted axes, all for None; raises BadInput for an unknown axis."""
    if wanted is None:
        return list(range(len(axes)))
    unknown = [name for name in wanted if name not in axes]
    if unknown:
        raise BadInput("axis", ", ".join(unknown), ", ".join(axes), "Choose some of these.")
    return [axes.index(name) for name in wanted]
