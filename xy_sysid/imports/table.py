"""Columns read from a file without sample numbers --> Recording: what CSV, NPZ and MAT have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.pairing import cut, is_jitter, steady
from xy_sysid.imports.units import to_si
from xy_sysid.recording import Recording, rate_from_time
from xy_sysid.stream import FloatArray

USUAL = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Table:
    """What a file holds, as it is.

    time: (n,) s, or None with ``fs`` in Hz; seq: (n,) sample numbers if the file has them; values (n, axes) each
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


def axis_names(count: int) -> tuple[str, ...]:
    """x, y, z, axis4, ..."""
    return tuple(USUAL[i] if i < len(USUAL) else f"axis{i + 1}" for i in range(count))


def _numbers(path: Path, time: FloatArray, notes: list[str]) -> tuple[FloatArray, FloatArray, float]:
    """Sample numbers from instants, which must increase; the instants, and the rate."""
    try:
        rate = rate_from_time(time)
    except BadInput as error:
        raise BadRecording(path, f"{error.what} is {error.value}", error.act) from None
    steps = np.diff(time) * rate
    if steps.size and float(steps.min()) < -1.0:
        row = int(np.argmin(steps)) + 1
        raise BadRecording(path, f"time falls back from {time[row - 1]:.9g} to {time[row]:.9g} s at sample {row + 1}", "Sort the samples by time.")
    seq = np.concatenate(([0.0], np.cumsum(np.rint(steps))))
    drift = np.rint((time - time[0]) * rate)
    if float(np.max(np.abs(seq - drift))) <= 1:
        seq = drift
    if is_jitter(np.diff(seq)):
        notes.append("the time column jitters by more than half a sample; samples are numbered as they stand, with even times")
        even = steady(time)
        return np.arange(len(time), dtype=np.float64), even, rate_from_time(even)
    return seq, time, rate


def recording(path: Path, table: Table, wanted: Sequence[str] | None, start: float, stop: float | None, notes: list[str]) -> Recording:
    """Check, convert to SI, number and cut; raises BadRecording or BadInput."""
    rows = len(table.input)
    lengths = {"input": rows, "output": len(table.output)} | ({} if table.time is None else {"time": len(table.time)})
    if len(set(lengths.values())) > 1:
        raise BadRecording(path, "lengths differ: " + ", ".join(f"{name} {count}" for name, count in lengths.items()), "Give one row per sample.")
    if table.time is None:
        if table.fs is None or not (np.isfinite(table.fs) and table.fs > 0):
            raise BadRecording(path, f"neither a time column nor a usable fs ({table.fs})", "Add t in seconds, or fs in Hz.")
        time = (np.arange(rows) if table.seq is None else table.seq) / table.fs
        notes.append(f"there is no time; fs = {table.fs:g} Hz is taken")
    else:
        time = table.time
    voltage, input_unit = to_si(table.input, table.input_unit, "the input", notes)
    position, output_unit = to_si(table.output, table.output_unit, "the output", notes)
    reference = None if table.reference is None else to_si(table.reference, table.output_unit, "the reference", [])[0]
    finite = np.isfinite(time) & np.isfinite(voltage).all(axis=1) & np.isfinite(position).all(axis=1)
    if not finite.all():
        notes.append(f"{int(np.sum(~finite))} rows are not numbers; they are left out")
        time, voltage, position = time[finite], voltage[finite], position[finite]
        reference = None if reference is None else reference[finite]
    if len(time) < 2:
        raise BadRecording(path, f"{len(time)} samples", "A recording needs 2 or more; record for longer.")
    seq, time, rate = _numbers(path, time, notes) if table.seq is None else (table.seq[finite], time, 0.0)
    fresh = np.concatenate(([True], seq[1:] > np.maximum.accumulate(seq)[:-1]))
    if not fresh.all():
        if table.seq is not None and bool(np.any(np.diff(seq) < 0)):
            raise BadRecording(path, "seq does not increase", "Sort the samples by seq.")
        notes.append(f"{int(np.sum(~fresh))} samples are there twice; the first is kept")
        seq, time, voltage, position = seq[fresh], time[fresh], voltage[fresh], position[fresh]
        reference = None if reference is None else reference[fresh]
    numbers = np.rint(seq).astype(np.int64)
    if table.seq is not None or table.time is None:
        rate = table.fs if table.time is None and table.fs is not None else rate_from_time(time, numbers)
    if table.time is not None and table.fs is not None and abs(table.fs / rate - 1) > 1e-3:
        notes.append(f"fs says {table.fs:g} Hz, the time stamps {rate:.6g} Hz; the stamps are taken")
    columns = _columns(table.axes, wanted)
    result = Recording(
        sampling_rate=rate,
        axes=tuple(table.axes[i] for i in columns),
        seq=numbers,
        time=time,
        voltage=np.ascontiguousarray(voltage[:, columns]),
        position=np.ascontiguousarray(position[:, columns]),
        input_unit=input_unit,
        output_unit=output_unit,
        reference=None if reference is None else np.ascontiguousarray(reference[:, columns]),
        source=str(path),
        notes=tuple(notes),
    )
    return cut(result, float(time[0]), start, stop)


def _columns(axes: tuple[str, ...], wanted: Sequence[str] | None) -> list[int]:
    if wanted is None:
        return list(range(len(axes)))
    unknown = [name for name in wanted if name not in axes]
    if unknown:
        raise BadInput("axis", ", ".join(unknown), ", ".join(axes), "Choose some of these.")
    return [axes.index(name) for name in wanted]
