"""Several recordings of one machine: read alike, checked to belong together, and as one where a command takes one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.imports import load
from xy_sysid.imports.paired_streams import SAME_RATE
from xy_sysid.imports.reading import Reading
from xy_sysid.samples.recording import Recording


def read_all(paths: Sequence[Path], reading: Reading, progress: Callable[[float], None] | None = None) -> tuple[Recording, ...]:
    """Each of the recordings, with the axes that all of them have; of several, each note says which it is about.

    Raises BadRecording or BadInput: what cannot be read, units that differ, no axis in common.
    """
    if not paths:
        raise BadInput("recordings", "none", "one or more", "Give a file.")
    found: list[Recording] = []
    for number, path in enumerate(paths):

        def tell(part: float, number: int = number) -> None:
            if progress is not None:
                progress((number + part) / len(paths))

        found.append(load(path, reading, progress=tell))
    if len(found) == 1:
        return tuple(found)
    return tuple(_alike(found))


def _alike(found: list[Recording]) -> list[Recording]:
    first = found[0]
    units = [(one.input_unit, one.output_unit) for one in found]
    for one, unit in zip(found, units, strict=True):
        if unit != units[0]:
            given = f"{', '.join(units[0])} in {first.source} and {', '.join(unit)} in {one.source}"
            raise BadInput("units of the recordings", given, "the same in all", "Say them with --unit, or give recordings of one machine.")
    axes = tuple(axis for axis in first.axes if all(axis in one.axes for one in found))
    if not axes:
        given = "; ".join(f"{', '.join(one.axes)} in {one.source}" for one in found)
        raise BadInput("axes of the recordings", given, "one in common", "Name the columns alike with --map.")
    alike = []
    for one in found:
        notes = [f"{one.source}: {note}" for note in one.notes]
        if set(one.axes) != set(axes):
            notes.append(f"{one.source}: only {', '.join(axes)} is in all recordings; {', '.join(a for a in one.axes if a not in axes)} is left out")
        columns = [one.axes.index(axis) for axis in axes]
        reference = None if one.reference is None else one.reference[:, columns]
        alike.append(
            dataclasses.replace(
                one, axes=axes, voltage=one.voltage[:, columns], position=one.position[:, columns], reference=reference, notes=tuple(notes)
            )
        )
    return alike


def joined(recordings: Sequence[Recording]) -> Recording:
    """One recording of all, with a gap between each and the next; its time goes on. Raises BadInput if their rates differ."""
    first = recordings[0]
    if len(recordings) == 1:
        return first
    for one in recordings[1:]:
        if abs(one.sampling_rate / first.sampling_rate - 1) > SAME_RATE:
            given = f"{first.sampling_rate:.6g} Hz in {first.source} and {one.sampling_rate:.6g} Hz in {one.source}"
            raise BadInput("sampling rates", given, "the same in all", "Give them one by one, or say --rate if the stamps are wrong.")
    seq, time, end, late = [], [], int(first.seq[0]), float(first.time[0])
    for one in recordings:
        seq.append(one.seq - one.seq[0] + end)
        time.append(one.time - one.time[0] + late)
        end, late = int(seq[-1][-1]) + 2, float(time[-1][-1]) + 2 / first.sampling_rate
    sizes = ", ".join(f"{one.source} ({len(one) / one.sampling_rate:.4g} s)" for one in recordings)
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
