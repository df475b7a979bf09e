"""One file -> its rows: the task of the fleet's processes. It needs only the file and writes nothing."""

from __future__ import annotations

import hashlib
import json
import platform
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import process_time

from threadpoolctl import threadpool_limits

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.files.effects import library
from xy_sysid.fleets.digest import digest
from xy_sysid.fleets.naming import Name, Names, date_within, name_of
from xy_sysid.fleets.row import FirstSets, Plan, Row, row_of
from xy_sysid.imports import load
from xy_sysid.imports.reading import Reading

ROWS = 3  # version of the meaning of a row; increased whenever the same data give other numbers or columns


@dataclass(frozen=True, slots=True)
class Task:
    """One recording to be analysed.

    path: of the recording; names: how it is named; reading: how its columns are read; effect_files: the user's own effects
    first: by axis, effects that are tried before all others; known: keys with which it is already in the table
    """

    path: str
    names: Names = field(default_factory=Names)
    reading: Reading = field(default_factory=Reading)
    effect_files: tuple[str, ...] = ()
    first: FirstSets = ()
    known: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Done:
    """The result of a task. rows: one per axis; empty if the table already has them (``unchanged``), with this key."""

    path: str
    rows: tuple[Row, ...]
    unchanged: bool = False
    key: str = ""


def rows_of_file(task: Task) -> Done:
    """The rows of one recording. An error that the user can correct (``XySysidError``) becomes a row with its problem; others are raised."""
    path, follow = Path(task.path), tuple(task.names.follow)
    try:
        content = digest(path)
    except (OSError, BadRecording) as error:
        text = f"cannot be read ({error.strerror or error}). Check the path and the permissions." if isinstance(error, OSError) else str(error)
        row = failed(task.path, "reading", text)
        with suppress(BadInput):
            name = name_of(path, task.names)
            row |= {"machine": name.machine, "date": name.date}
        return Done(task.path, (row,))
    try:
        name = name_of(path, task.names)
    except BadInput as problem:
        return Done(task.path, (failed(task.path, "naming", str(problem)) | {"file_sha256": content},))
    origin = _origin(task, name, content)
    if origin["key"] in task.known:
        return Done(task.path, (), unchanged=True, key=origin["key"])
    with threadpool_limits(1, "blas"):
        begun = process_time()
        try:
            recording = load(path, task.reading)
            if name.axis and len(recording.axes) > 1:
                raise BadInput("axis", name.axis, f"none, since the file has {', '.join(recording.axes)}", "Leave {axis} out of the pattern.")
            known = library(task.effect_files)
            for effect in follow:
                known[effect]
        except (BadRecording, BadInput) as problem:
            return Done(task.path, (failed(task.path, "reading", str(problem)) | {"date": name.date} | origin,))
        seconds = process_time() - begun
        origin |= {"machine": name.of(recording), "date": name.date or date_within(recording), "seconds_reading": seconds}
        first = tuple((recording.axes[0] if axis == name.axis else axis, effects) for axis, effects in task.first)
        plan = Plan(follow=follow, first=first, library=known, clock=process_time)
        rows = [row_of(recording, axis, plan) for axis in recording.axes]
    return Done(task.path, tuple(row | ({"axis": name.axis} if name.axis else {}) | origin for row in rows))


def lost(task: Task, problem: str) -> Done:
    """The row of a recording whose process gave no answer. Its key prevents a retry by the same version."""
    row, path = failed(task.path, "worker", problem), Path(task.path)
    with suppress(OSError, BadRecording, BadInput):  # without a key
        name = name_of(path, task.names)
        row |= _origin(task, name, digest(path)) | {"date": name.date}
    return Done(task.path, (row,))


def _origin(task: Task, name: Name, content: str) -> Row:
    """The columns that all rows of a recording share. content: the hash of its file"""
    return {
        "source": task.path,
        "file_sha256": content,
        "machine": name.machine,
        "versions": versions(),
        "key": key_of(task, name, content),
    }


def failed(path: str, stage: str, problem: str) -> Row:
    """The row of a recording that could not be read, with the reason; the folder is used as the machine."""
    text, folder = problem.removeprefix(f"{path}: "), Path(path).absolute().parent.name
    own: Row = {"machine": folder, "axis": "", "date": None, "source": path, "file_sha256": "", "key": ""}
    return own | {"stage": stage, "problem": text}


def key_of(task: Task, name: Name, content: str) -> str:
    """The identity of a recording: its content, its name, the options of reading and analysis, and the version."""
    own = [digest(Path(file)) for file in task.effect_files]
    parts = [
        content,
        name.machine,
        name.axis,
        str(name.date),
        repr(task.reading),
        sorted(task.names.follow),
        own,
        task.first,
        package_version(),
        ROWS,
    ]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def package_version() -> str:
    """Version of xy_sysid."""
    try:
        return version("xy_sysid")
    except PackageNotFoundError:
        return "from source"


def versions() -> str:
    """Versions of all software that affects a row, in one line."""
    others = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    return f"xy_sysid {package_version()}, rows {ROWS}, python {platform.python_version()}, {others}"
