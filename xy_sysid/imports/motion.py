"""Angles that wrap; and velocity or acceleration --> position, by the law of ``samples.integral``."""

from __future__ import annotations

import dataclasses

import numpy as np

from xy_sysid.imports.foreign_units import COUNTS
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.integral import detrended, integral
from xy_sysid.samples.recording import Recording

TURN, NEARLY = 2 * np.pi, 0.5  # rad; an angle wraps if a step is a turn within NEARLY, and usual steps are smaller
FEWEST = 8  # bits of the shortest counter that is distinguished from small steps
LOOK = 200_000  # samples from which the usual step is taken


def wraps(values: FloatArray, turn: float = TURN) -> int:
    """How often values (n,) jump by a whole turn from one sample to the next, as an angle (rad) that is kept within a turn."""
    steps, nearly = np.abs(np.diff(values)), NEARLY * turn / TURN
    usual = float(np.quantile(steps[:LOOK], 0.9)) if steps.size else 0.0
    return int(np.sum(np.abs(steps - turn) < nearly)) if usual < nearly else 0


def unwrapped(reference: FloatArray, position: FloatArray) -> FloatArray:
    """A reference (n,), rad, unwrapped, and starting within half a turn of the position (n,); unchanged if it never jumps by a turn."""
    if not wraps(reference):
        return reference
    whole = np.unwrap(reference)
    return np.asarray(whole - TURN * np.rint((whole[0] - position[0]) / TURN))


def leaps(values: FloatArray, unit: str) -> str:
    """A note if values (n,) in m or counts wrap like a counter of 2^k counts, or like degrees that are taken as m; empty otherwise."""
    largest = float(np.max(np.abs(np.diff(values)), initial=0.0))
    turn = 2.0 ** np.rint(np.log2(largest)) if unit == COUNTS and largest > 0 else 360.0 if unit == "m" else 0.0
    count = wraps(values, turn) if turn >= 2**FEWEST and np.ptp(values) <= turn else 0  # a counter that wraps never leaves its range
    if not count:
        return ""
    act = "give --unit output=deg if it is one of degrees" if unit == "m" else "unwrap it first"
    return f"the output leaps by {turn:g} {count} times, as {'an angle' if unit == 'm' else 'a counter'} that wraps: {act}"


def as_position(recording: Recording) -> Recording:
    """The recording with the integral of the measured velocity or acceleration as position; unchanged if a position was measured."""
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
    """Each run minus its straight line."""
    values = values.copy()
    for run in recording.runs():
        values[run] = np.column_stack([detrended(column) for column in values[run].T])
    return values
