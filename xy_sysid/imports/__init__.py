"""Recordings in and out, whatever the file: a rosbag2, CSV, NPZ or MAT."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.bags import POSITION, REFERENCE, VOLTAGE, BagWriter
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import arrays, csv, table
from xy_sysid.imports.bag import load_bag
from xy_sysid.recording import Recording
from xy_sysid.stream import Block

ROWS = 20  # samples in one message of a bag that is written here
KINDS = "a rosbag2 folder, .db3, .mcap, .csv, .mat, .npz"

__all__ = ["blocks", "load", "save", "writer_of"]


def load(
    path: Path | str,
    *,
    voltage_topic: str = VOLTAGE,
    position_topic: str = POSITION,
    joint_topic: str | None = None,
    axes: Sequence[str] | None = None,
    effort_as_voltage: bool = False,
    input_key: str | None = None,
    output_key: str | None = None,
    start: float = 0.0,
    stop: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """A recording from a rosbag2 (folder or file), .csv, .npz or .mat, paired, checked and in SI.

    voltage_topic, position_topic: block topics of a bag; joint_topic: its JointState topic, found if there is one only
    axes:               which axes to take, and in which order; None is all
    effort_as_voltage:  take the joints' effort as the input, even if there is a voltage topic
    input_key, output_key: how the input and output of a table are called, where not voltage (u) and position (y)
    start, stop:        s after the first sample; None is the end
    progress:           called with the part that has been read, 0..1
    Raises BadRecording (the file) or BadInput (an argument), one line each. What was odd is in ``notes``.
    """
    path = Path(path)
    if not start >= 0 or (stop is not None and not stop > start):
        raise BadInput("start and stop", f"{start}, {stop}", "0 <= start < stop, in s", "Choose another part.")
    try:
        kind = "" if path.is_dir() else path.suffix.lower()
        path.stat()
        if kind in ("", ".db3", ".mcap"):
            return load_bag(path, voltage_topic, position_topic, joint_topic, axes, effort_as_voltage, start, stop, progress)
        if kind not in (".csv", ".txt", ".tsv", ".npz", ".mat"):
            raise BadRecording(path, f"a file of kind {path.suffix!r}, which is not a recording", f"Give {KINDS}.")
        if path.stat().st_size == 0:
            raise BadRecording(path, "the file is empty (0 bytes)", "Take another copy of the file.")
        notes: list[str] = []
        if kind in (".npz", ".mat"):
            content = arrays.read_npz(path) if kind == ".npz" else arrays.read_mat(path)
            found = arrays.table(path, content, input_key, output_key)
        else:
            found = csv.read(path, input_key, output_key, notes)
        result = table.recording(path, found, axes, start, stop, notes)
    except OSError as error:
        raise BadRecording(path, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
    if progress is not None:
        progress(1.0)
    return result


def save(recording: Recording, path: Path | str) -> None:
    """Write a recording so that ``load`` gives the same back: .csv, .npz, .mat, a bare .db3 or .mcap, or else a bag's folder.

    Raises BadRecording if the path exists (bags) or cannot be written, BadInput for an ending that is not known.
    """
    path = Path(path)
    writer = writer_of(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writer(path, recording)
    except OSError as error:
        raise BadRecording(path, f"cannot be written ({error.strerror or error})", "Choose a folder that you may write to.") from None


def writer_of(path: Path) -> Callable[[Path, Recording], None]:
    """What writes such a file; raises BadInput for an ending that is not known."""
    writers = {".csv": csv.write, ".npz": arrays.write_npz, ".mat": arrays.write_mat, ".db3": _write_bag, ".mcap": _write_bag, "": _write_bag}
    if path.suffix not in writers:
        allowed = f"{', '.join(ending for ending in writers if ending)}, or none for a rosbag2 folder"
        raise BadInput("file ending", repr(path.suffix), allowed, "Choose one of these.")
    return writers[path.suffix]


def blocks(recording: Recording, rows: int = ROWS) -> list[tuple[Block, Block]]:
    """(voltage, position) blocks of up to ``rows`` samples; none reaches over a gap."""
    return [(a, b) for a, b, _ in _blocks(recording, rows)]


def _blocks(recording: Recording, rows: int) -> list[tuple[Block, Block, slice]]:
    made = []
    seq = recording.seq.astype(np.float64)
    for run in recording.runs():
        for begin in range(run.start, run.stop, rows):
            part = slice(begin, min(begin + rows, run.stop))
            values = (recording.voltage[part], recording.position[part])
            voltage, position = (Block(recording.axes, seq[part], recording.time[part], each) for each in values)
            made.append((voltage, position, part))
    return made


def _write_bag(path: Path, recording: Recording) -> None:
    units = {"input_unit": recording.input_unit, "output_unit": recording.output_unit}
    earliest = float(recording.time.min()) if len(recording) else 0.0
    shift = min(0.0, earliest)  # a bag's clock has no negative times
    with BagWriter(path, custom=units if (recording.input_unit, recording.output_unit) != ("V", "m") else None) as writer:
        for voltage, position, part in _blocks(recording, ROWS):
            now = int((voltage.time[-1] - shift) * 1e9)
            writer.write_block(VOLTAGE, voltage, now)
            writer.write_block(POSITION, position, now)
            if recording.reference is not None:
                writer.write_block(REFERENCE, Block(voltage.axes, voltage.seq, voltage.time, recording.reference[part]), now)
