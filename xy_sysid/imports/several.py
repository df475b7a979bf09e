"""Several recordings of one machine: read with the same options, checked for equal units and axes, and joined to one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.imports import load
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.several_files import others
from xy_sysid.samples.recording import SAME_RATE, Recording

NAMED = 3  # most recordings that a note names


def read_all(paths: Sequence[Path], reading: Reading, progress: Callable[[float], None] | None = None) -> tuple[Recording, ...]:
    """The recordings, each with the axes that all of them have; if there are several, each note names its recordings.

    Raises BadRecording or BadInput for a file that cannot be read, units that differ, or no common axis.
    """
    if not paths:
        raise BadInput("recordings", "none", "one or more", "Give a file.")
    together = others(paths[0], reading.columns)
    paths = [path for number, path in enumerate(paths) if number == 0 or path.resolve() not in together]  # columns of one recording
    found: list[Recording] = []
    for number, path in enumerate(paths):

        def tell(part: float, number: int = number) -> None:
            if progress is not None:
                progress((number + part) / len(paths))

        found.append(load(path, reading, progress=tell))
    if len(found) == 1:
        return tuple(found)
    return _said_once(_alike(found))


def _said_once(found: list[Recording]) -> tuple[Recording, ...]:
    """The recordings with each note once, at the first recording that has it, with the names of all that have it."""
    whose: dict[str, list[str]] = {}
    for one in found:
        for note in dict.fromkeys(one.notes):
            whose.setdefault(note, []).append(one.source)
    kept: list[Recording] = []
    for one in found:
        mine = [note for note in dict.fromkeys(one.notes) if whose[note][0] == one.source]
        kept.append(dataclasses.replace(one, notes=tuple(f"{_named(whose[note], len(found))}: {note}" for note in mine)))
    return tuple(kept)


def _named(sources: list[str], every: int) -> str:
    if len(sources) == every:
        return f"all {every} recordings"
    return ", ".join(sources) if len(sources) <= NAMED else f"{', '.join(sources[: NAMED - 1])} and {len(sources) - NAMED + 1} others"


def _alike(found: list[Recording]) -> list[Recording]:
    first = found[0]
    units = [(one.input_unit, one.output_unit) for one in found]
    for one, unit in zip(found, units, strict=True):
        if unit != units[0]:
            given = f"{', '.join(units[0])} in {first.source} and {', '.join(unit)} in {one.source}"
            raise BadInput("units of the recordings", given, "the same in all", "Give them with --unit, or give recordings of one machine.")
    axes = tuple(axis for axis in first.axes if all(axis in one.axes for one in found))
    if not axes:
        given = "; ".join(f"{', '.join(one.axes)} in {one.source}" for one in found)
        raise BadInput("axes of the recordings", given, "one in common", "Name the columns alike with --map.")
    alike = []
    for one in found:
        notes = list(one.notes)
        if set(one.axes) != set(axes):
            notes.append(f"only {', '.join(axes)} is in all recordings; {', '.join(a for a in one.axes if a not in axes)} is left out")
        columns = [one.axes.index(axis) for axis in axes]
        reference = None if one.reference is None else one.reference[:, columns]
        alike.append(
            dataclasses.replace(
                one, axes=axes, voltage=one.voltage[:, columns], position=one.position[:, columns], reference=reference, notes=tuple(notes)
            )
        )
    return alike


def joined(recordings: Sequence[Recording]) -> Recording:
    """One recording of all, with a gap between each and the next, and continuing time. Raises BadInput if their rates differ."""
    first = recordings[0]
    if len(recordings) == 1:
        return first
    for one in recordings[1:]:
        if abs(one.sampling_rate / first.sampling_rate - 1) > SAME_RATE:
            given = f"{first.sampling_rate:.6g} Hz in {first.source} and {one.sampling_rate:.6g} Hz in {one.source}"
            raise BadInput("sampling rates", given, "the same in all", "Give them one by one, or use --rate if the stamps are wrong.")
    seq, time, end, late = [], [], int(first.seq[0]), float(first.time[0])
    for one in recordings:
        seq.append(one.seq - one.seq[0] + end)
        time.append(one.time - one.time[0] + late)
        end, late = int(seq[-1][-1]) + 2, float(time[-1][-1]) + 2 / first.sampling_rate
    seconds = [len(one) / one.sampling_rate for one in recordings]
    sizes = ", ".join(f"{one.source} ({length:.4g} s)" for one, length in zip(recordings, seconds, strict=True))
    if len(recordings) > NAMED:
        sizes = f"{min(seconds):.4g} to {max(seconds):.4g} s each, {sum(seconds):.4g} s in all"
    references = [one.reference for one in recordings if one.reference is not None]
    return dataclasses.replace(
        first,
        seq=np.concatenate(seq),
        time=np.concatenate(time),
        voltage=np.concatenate([one.voltage for one in recordings]),
        position=np.concatenate([one.position for one in recordings]),
        reference=np.concatenate(references) if len(references) == len(recordings) else None,
        source=", ".join(one.source for one in recordings),
        notes=(*(note for one in recordings for note in one.notes), f"{len(recordings)} recordings, one after the other: {sizes}"),
    )
