"""Angles that wrap; and velocity or acceleration --> position, by the law of ``samples.integral``, so that all works on positions."""

from __future__ import annotations

import dataclasses

import numpy as np

from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.integral import detrended, integral
from xy_sysid.samples.recording import Recording

TURN, NEARLY = 2 * np.pi, 0.5  # rad; a step that is a turn within so much, where others are smaller than that, is an angle that wraps
LOOK = 200_000  # samples from which the usual step is taken


def wraps(angle: FloatArray) -> int:
    """How often an angle (n,), rad, leaps by a whole turn from one sample to the next, as one that is kept within a turn."""
    steps = np.abs(np.diff(angle))
    usual = float(np.quantile(steps[:LOOK], 0.9)) if steps.size else 0.0
    return int(np.sum(np.abs(steps - TURN) < NEARLY)) if usual < NEARLY else 0


def as_position(recording: Recording) -> Recording:
    """The same recording with the integral of what was measured as its position; as it is if that was a position."""
    if recording.measured == "position":
        return recording
    unit = recording.output_unit
    notes = list(recording.notes)
    values = recording.position
    if recording.measured == "acceleration":
        values = _integral(recording, values - values.mean(axis=0))
        values = _without_line(recording, values)
        notes.append(
            f"the output is an acceleration ({unit}): responses and errors are those of the acceleration; positions and speeds are its integrals "
            f"without mean and slow drift, so a constant load cannot be seen, and a delay that diagnose and refine find contains a whole sample "
            f"({1e3 / recording.sampling_rate:.3g} ms)"
        )
    else:
        notes.append(
            f"the output is a velocity ({unit}): responses and errors are those of the velocity; positions are its integral and count from 0, "
            f"and a delay that diagnose and refine find contains half a sample ({0.5e3 / recording.sampling_rate:.3g} ms), "
            "or a whole one if the drive differences its encoder"
        )
    measured = _integral(recording, values)
    reference = None if recording.reference is None else _integral(recording, recording.reference)
    if recording.measured == "acceleration":
        reference = None
    return dataclasses.replace(
        recording, position=measured, reference=reference, output_unit=unit.removesuffix("/s^2").removesuffix("/s"), notes=tuple(notes)
    )


def _integral(recording: Recording, values: FloatArray) -> FloatArray:
    return integral(values, np.diff(recording.seq) / recording.sampling_rate)


def _without_line(recording: Recording, values: FloatArray) -> FloatArray:
    """Each run less its straight line."""
    values = values.copy()
    for run in recording.runs():
        values[run] = np.column_stack([detrended(column) for column in values[run].T])
    return values
