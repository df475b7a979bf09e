"""Recordings from and to files of any format.

reading:              options for reading a file: the meaning of columns
bag, paired_streams:  two streams of a bag, paired by sample number
registry:             which reader reads which file, one row per format
csv, arrays, twincat, codesys, mitsubishi, json_log: files as sheets of columns
text_table, echoed, klipper: the table in a text file; the CSV of ros2 topic echo; accelerations of Klipper
libraries, guarded, guarded_child, leaves: formats that other packages read, in a separate process, as sheets of columns
several_files, own_times: columns from several files, and columns with their own times, as one table
sheet, names, roles:  the role of each column, from its name or from the user
sheet_table, table, even: columns in SI, numbered by their time, which may be uneven
clock:                time against the sample counter
instants:             dates and times in seconds
foreign_units, given: units of foreign files
motion:               velocity and acceleration become position
plausible:            warnings about implausible data
several, listing:     several recordings as one; the content of a file
in_parts:             a long recording, part by part
response_file:        a file with a measured frequency response
limits:               maximum size of a file in memory
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.bags import POSITION, REFERENCE, VOLTAGE, BagWriter
from xy_sysid.bags.atomic import taken, whole
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import arrays, csv, sheet_table, table
from xy_sysid.imports.bag import load_bag
from xy_sysid.imports.motion import as_position
from xy_sysid.imports.paired_streams import cut
from xy_sysid.imports.plausible import meaningful, remarks, without_dead_parts
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.registry import BAG, TABLES, Format, format_of, sheet_of
from xy_sysid.imports.several_files import of_several_files
from xy_sysid.samples.block import Block
from xy_sysid.samples.recording import Recording

ROWS = 20  # samples in one message of a bag that is written here

__all__ = ["TABLES", "Reading", "blocks", "format_of", "load", "save", "sheet_of", "writer_of"]


def load(path: Path | str, reading: Reading | None = None, *, progress: Callable[[float], None] | None = None, **options: Any) -> Recording:
    """A recording from a rosbag2 (folder or file) or any file of ``registry.FORMATS``, paired, checked and in SI.

    reading:  the meaning of columns, the part and the axes to read; see ``Reading``, whose fields may also be given by keyword
    progress: called with the fraction that has been read, 0..1
    Raises BadRecording (the file) or BadInput (an argument), one line each. Irregularities of the file are in ``notes``.
    """
    path, reading = Path(path), dataclasses.replace(reading or Reading(), **options)
    with np.errstate(all="ignore"):  # damaged numbers are left out or reported, so numpy need not warn
        try:
            kind = format_of(path)
            result = load_bag(path, reading, progress) if kind is BAG else cut(*from_table(path, kind, reading), reading.start, reading.stop)
        except OSError as error:
            raise BadRecording(path, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
        if progress is not None:
            progress(1.0)
        return finished(path, result)


def finished(path: Path, result: Recording) -> Recording:
    """A recording or a part of one for the user: with positions, without dead parts, with warnings about implausible data."""
    result = without_dead_parts(meaningful(path, result))
    output, moved = result.position, as_position(result)
    return dataclasses.replace(moved, notes=(*moved.notes, *remarks(moved, output)))


def from_table(path: Path, kind: Format, reading: Reading) -> tuple[Recording, float]:
    """A whole table, and the instant from which times of its parts count, s."""
    topics = reading.voltage_topic, reading.position_topic, reading.joint_topic
    if reading.effort_as_voltage or reading.velocity or reading.joints or reading.effort_lag or topics != (VOLTAGE, POSITION, None):
        raise BadInput("--topic, --effort, --velocity or --joint", f"for {path}", "for a bag", "A table has columns: choose them with --map.")
    if reading.a_response(kind.kind == "response"):
        raise BadRecording(path, "a measured frequency response, which holds no samples in time", "Fit it: xy-sysid fit, or xy.frf_from in Python.")
    notes: list[str] = []
    sheet, reading = of_several_files(path, reading, notes) or (sheet_of(path, kind), reading)
    found = arrays.table(sheet, reading, notes) or sheet_table.table(sheet, reading, notes)
    return table.uncut(path, found, reading, notes)


def save(recording: Recording, path: Path | str) -> None:
    """Write a recording that ``load`` restores: .csv, .npz, .mat, a bare .db3 or .mcap, or a bag's folder; completely or not at all.

    Raises BadRecording if the path exists (bags) or cannot be written, BadInput for an unknown ending.
    """
    path = Path(path)
    writer = writer_of(path)
    if writer is _write_bag and taken(path):
        raise BadRecording(path, "exists already", "Choose another name; nothing is overwritten.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadRecording(path, f"cannot be written ({error.strerror or error})", "Choose a folder that you may write to.") from None
    with whole(path) as part:
        writer(part, recording)


def writer_of(path: Path) -> Callable[[Path, Recording], None]:
    """The writer of a file by its ending; raises BadInput for an unknown ending."""
    writers = {".csv": csv.write, ".npz": arrays.write_npz, ".mat": arrays.write_mat, ".db3": _write_bag, ".mcap": _write_bag, "": _write_bag}
    if path.suffix not in writers:
        allowed = f"{', '.join(ending for ending in writers if ending)}, or none for a rosbag2 folder"
        raise BadInput("file ending", repr(path.suffix), allowed, "Choose one of these.")
    return writers[path.suffix]


def blocks(recording: Recording, rows: int = ROWS) -> list[tuple[Block, Block]]:
    """(voltage, position) blocks of up to ``rows`` samples, without gaps."""
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
    custom = units if (recording.input_unit, recording.output_unit) != ("V", "m") else {}
    if recording.machine and not path.suffix:  # a bare file has no field for it
        custom = {**custom, "machine": recording.machine}
    earliest = float(recording.time.min()) if len(recording) else 0.0
    shift = min(0.0, earliest)  # a bag's clock has no negative times
    with BagWriter(path, custom=custom or None) as writer:
        for voltage, position, part in _blocks(recording, ROWS):
            now = int((voltage.time[-1] - shift) * 1e9)
            writer.write_block(VOLTAGE, voltage, now)
            writer.write_block(POSITION, position, now)
            if recording.reference is not None:
                writer.write_block(REFERENCE, Block(voltage.axes, voltage.seq, voltage.time, recording.reference[part]), now)
