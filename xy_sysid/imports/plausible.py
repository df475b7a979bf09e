"""Warnings about a recording, in words. Values are not corrected, because only the user knows the true ones.

Thresholds are far beyond every machine axis in the measured data (../docs/real-data.md); they only cause questions.
"""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording
from xy_sysid.imports.foreign_units import DRIVES, unit_of
from xy_sysid.imports.motion import wraps
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.moves import ONE_MOVE, one_move
from xy_sysid.samples.recording import SLOWEST, Recording

HUGE = 1e100  # larger numbers, or their derivatives, have no finite square
FAR, FAST = 20.0, 50.0  # m and m/s; longer or faster axes cause a question
TURNING = 3000.0  # rad/s, 30,000 turns a minute
TINY = {"m": 1e-8, "rad": 1e-8, "V": 1e-6, "A": 1e-6}  # a signal with a smaller range causes a question
ROUGH = 0.5  # steps over spread; a position is smoother than that, noise is not
SMOOTHER = 0.25  # of the output's roughness; a smoother input may be a position
LIKE = 0.5  # least correlation of one signal's steps with the other, if they have been swapped
LEAKS = (1.0, 0.3, 0.1, 0.03, 0.01)  # poles of the assumed axis in the test for swapped signals, per sample
STUCK_SECONDS, STUCK_PART = 1.0, 0.1  # s, and part of the recording: a longer rest of the output while the input moves is reported
DEAD_PART = 0.2  # of the recording; a longer rest while the input moves as elsewhere is left out
LIVELY = 0.8  # of the input's spread and steps elsewhere; with as much input it is not friction that holds the output
CLIPPED = 0.05  # part of the samples at one end of the range
LEVELS = 8  # a signal of fewer levels is a switching one, and is often at its ends
COARSE = 0.02  # of the usual step; coarser resolution of numbers, due to an offset, is reported
FEW = 4  # different values of an output
ENOUGH = 50  # least samples for warnings
LOOK = 200_000  # most samples for steps and levels


def meaningful(path: Path, recording: Recording) -> Recording:
    """The recording without axes whose input and output are equal. Raises BadRecording if none is left, or for numbers above ``HUGE``."""
    for name, values in (("input", recording.voltage), ("output", recording.position)):
        largest = float(np.max(np.abs(values))) if values.size else 0.0
        if largest > HUGE:
            raise BadRecording(path, f"the {name} reaches {largest:.3g}, which cannot be squared", "Give its unit with --unit, or --scale.")
    if len(recording) < ENOUGH:
        return recording
    same = [axis for axis in recording.axes if np.array_equal(*recording.axis(axis)) and float(np.ptp(recording.axis(axis)[0])) > 0]
    if not same:
        return recording
    problem = f"input and output of axis {', '.join(same)} are the same numbers, one column taken for both"
    columns = [place for place, axis in enumerate(recording.axes) if axis not in same]
    if not columns:
        raise BadRecording(path, problem, "Choose two columns with --map input=...,output=... (see xy-sysid columns FILE).")
    return dataclasses.replace(
        recording,
        axes=tuple(recording.axes[place] for place in columns),
        voltage=recording.voltage[:, columns],
        position=recording.position[:, columns],
        reference=None if recording.reference is None else recording.reference[:, columns],
        notes=(*recording.notes, f"{problem}; left out"),
    )


def without_dead_parts(recording: Recording) -> Recording:
    """The recording without long stretches in which an output is constant while the input moves as elsewhere: they become gaps.

    If the output also rests long elsewhere, the axis is held and its encoder works, as when the joints of a robot move one after another.
    """
    if len(recording) < ENOUGH:
        return recording
    keep = np.ones(len(recording), dtype=np.bool_)
    notes: list[str] = []
    for axis in recording.axes:
        u, y = recording.axis(axis)
        begin, size = _longest_rest(y)
        if float(np.ptp(y)) == 0.0 or size < DEAD_PART * len(y) or size < STUCK_SECONDS * recording.sampling_rate:
            continue
        inside = np.zeros(len(y), dtype=np.bool_)
        inside[begin : begin + size] = True
        if any(_is_long(_longest_rest(part)[1], part, recording.sampling_rate) for part in (y[:begin], y[begin + size :]) if len(part)):
            continue
        lively = all(0.0 < float(np.std(values[part])) >= LIVELY * float(np.std(values[other])) for values, part, other in _compared(u, inside))
        if not lively or int(np.sum(~inside)) < ENOUGH:
            continue
        keep &= ~inside
        notes.append(
            f"axis {axis}: the output is dead {_between(recording, begin, size)} although the input moves as elsewhere (encoder, enable, end stop?); "
            f"that part is left out{' of all axes' if len(recording.axes) > 1 else ''}"
        )
    if not notes or int(np.sum(keep)) < ENOUGH:
        return recording
    return dataclasses.replace(recording.only(keep), notes=(*recording.notes, *notes))


def _compared(u: FloatArray, inside: NDArray[np.bool_]) -> list[tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]]:
    """The input and its steps, each with its rows inside and outside."""
    both = inside[1:] & inside[:-1], ~inside[1:] & ~inside[:-1]
    return [(u, inside, ~inside), (np.diff(u), *both)]


def _is_long(rest: int, y: FloatArray, sampling_rate: float) -> bool:
    """Whether a rest of this many samples is long in time, and a large part of the output."""
    return rest >= STUCK_SECONDS * sampling_rate and rest >= STUCK_PART * len(y)


def _longest_rest(y: FloatArray) -> tuple[int, int]:
    """First sample and length of the longest stretch without any change."""
    edges = np.concatenate(([-1], np.flatnonzero(np.diff(y) != 0), [len(y) - 1]))
    place = int(np.argmax(np.diff(edges)))
    return int(edges[place]) + 1, int(np.diff(edges)[place])


def _between(recording: Recording, begin: int, size: int) -> str:
    end = "the end" if begin + size >= len(recording) else f"{recording.time[begin + size - 1]:.5g} s"
    return f"from {recording.time[begin]:.5g} s to {end} ({100 * size / len(recording):.0f} % of the samples)"


def remarks(recording: Recording, output: FloatArray) -> list[str]:
    """Warnings about the recording and about each axis. output: (n, axes) the measured quantity, which may be a velocity."""
    if len(recording) < ENOUGH:
        return _of_units(recording)
    found = _of_time(recording)
    with np.errstate(all="ignore"):  # numbers near the end of their range have no square; they are reported
        for place, axis in enumerate(recording.axes):
            u = recording.voltage[:, place]
            of_motion = _of_motion(recording, u, recording.position[:, place])
            found += [f"axis {axis}: {text}" for text in (*_of_axis(recording, u, output[:, place]), *of_motion)]
    return found + _of_units(recording)


def _of_time(recording: Recording) -> list[str]:
    rate, runs = recording.sampling_rate, recording.runs()
    found = []
    if rate < SLOWEST:
        found.append(f"the samples are {1 / rate:.4g} s apart ({rate:.4g} Hz): is time in ms, or a sample number? Give --unit time=ms, or --rate")
    if rate > 1e6:
        found.append(f"the samples are {1e9 / rate:.4g} ns apart ({rate:.4g} Hz): is this the right unit of time? Give --unit time=...")
    if len(runs) > 1:
        gaps = [(int(recording.seq[b.start] - recording.seq[a.stop - 1]) - 1, float(recording.time[a.stop - 1])) for a, b in itertools.pairwise(runs)]
        most, where = max(gaps)
        longest = max(run.stop - run.start for run in runs) / rate
        found.append(
            f"{len(gaps)} gap{'s' if len(gaps) > 1 else ''} in the samples, the longest of {most} ({most / rate:.4g} s) after {where:.6g} s; "
            f"the longest stretch without one lasts {longest:.4g} s"
        )
    most_rows = max(run.stop - run.start for run in runs)
    for axis in recording.axes:
        idle = (most_rows - len(recording.run(axis))) / rate
        if idle > 0.0:
            found.append(f"axis {axis} is neither driven nor moving for {idle:.4g} s at the ends of the recording, which are left out")
    return found


def _of_units(recording: Recording) -> list[str]:
    found = []
    drive, motion = unit_of(recording.input_unit).quantity, unit_of(recording.output_unit).quantity
    if drive not in (*DRIVES, "unknown"):
        found.append(
            f"the input is in {recording.input_unit}, which is not a drive signal: are columns swapped, or is it a target? "
            "xy-sysid servo models targets"
        )
    if motion in DRIVES:
        found.append(f"the output is in {recording.output_unit}, which is not a motion: are columns swapped, or is it a sensor's voltage (--scale)?")
    if drive == "current":
        found.append("the input is a current: if it was measured and not commanded, it is not held between samples (--set hold=none)")
    return found


def _of_axis(recording: Recording, u: FloatArray, y: FloatArray) -> list[str]:
    found = []
    ranges = float(np.ptp(u)), float(np.ptp(y))
    units = recording.input_unit, f"{recording.output_unit}{_per(recording)}"
    names = "input", "output"
    for name, size, unit in zip(names, ranges, units, strict=True):
        if size == 0.0:
            found.append(f"the {name} never changes")
        elif size < TINY.get(unit, 0.0):
            found.append(f"the {name} moves by {size:.3g} {unit} in all: is this the right unit? Give --unit or --scale")
    if 0.0 in ranges:
        return found
    found += _of_size(recording, y, ranges[1])
    swapped = _swapped(u, y)
    if swapped:
        found.append(swapped)
    found += _stuck(recording, u, y)
    for name, values in zip(names, (u, y), strict=True):
        found += _clipped(name, values, units[names.index(name)])
    return found


def _of_motion(recording: Recording, u: FloatArray, y: FloatArray) -> list[str]:
    """Warnings about too little motion."""
    runs = recording.runs()
    if len(runs) > 1 and float(np.ptp(u)) > 0.0 and all(float(np.ptp(u[run])) == 0.0 for run in runs):
        return [f"the input keeps one value in each of the {len(runs)} stretches: only the final speed of each can be determined"]
    return [f"{ONE_MOVE}: friction, load and inertia cannot be distinguished"] if len(runs) == 1 and one_move(y) else []


def _per(recording: Recording) -> str:
    return {"velocity": "/s", "acceleration": "/s^2"}.get(recording.measured, "")


def _of_size(recording: Recording, y: FloatArray, size: float) -> list[str]:
    """Warnings about travel, speed and resolution of a position."""
    found = []
    step = float(np.quantile(np.abs(np.diff(y[:LOOK])), 0.9))
    if recording.measured == "position":
        speed = step * recording.sampling_rate
        if recording.output_unit == "m" and (size > FAR or speed > FAST):
            found.append(f"the output moves over {size:.4g} m at {speed:.3g} m/s: is it in mm or counts? Give --unit output=mm, or --scale")
        if recording.output_unit == "rad" and speed > TURNING:
            found.append(f"the output turns at {speed:.3g} rad/s: is it in deg or counts? Give --unit output=deg, or --scale")
        turns = wraps(y) if recording.output_unit == "rad" else 0
        if turns:
            often = "once" if turns == 1 else f"{turns} times"
            found.append(f"the output leaps by a whole turn {often}, as an angle that wraps: unwrap it, or for joint states use --velocity")
    largest = float(np.max(np.abs(y)))
    apart = float(np.spacing(largest))
    if apart > COARSE * step and step > 0 and largest > 10 * size:
        found.append(
            f"the output lies at {largest:.3g}, where numbers are {apart:.2g} apart, and moves by {step:.2g} a sample: store it without offset"
        )
    levels = np.unique(y[:LOOK])
    if len(levels) <= FEW:
        found.append(f"the output has {len(levels)} different values in all: the axis stands, or its encoder is too coarse")
    return found


def _swapped(u: FloatArray, y: FloatArray) -> str:
    """A warning if a smooth input follows the integral of a rough output; empty otherwise."""
    rough = [float(np.std(np.diff(values)) / np.std(values)) for values in (u, y)]
    if not (np.isfinite(rough).all() and rough[1] > ROUGH and rough[0] < SMOOTHER * rough[1]):
        return ""
    steps = np.diff(u)
    best = max(abs(float(np.corrcoef(steps, _leaky(y, leak)[:-1])[0, 1])) for leak in LEAKS)
    if best < LIKE:
        return ""
    return f"the input is smooth, the output is not, and the input's steps follow the output (correlation {best:.2f}): are input and output swapped?"


def _leaky(values: FloatArray, leak: float) -> FloatArray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([leak], [1.0, leak - 1.0], values - values.mean()))


def _stuck(recording: Recording, u: FloatArray, y: FloatArray) -> list[str]:
    """A warning about the longest stretch in which the output is constant although the input moves."""
    begin, size = _longest_rest(y)
    if not _is_long(size, y, recording.sampling_rate):
        return []
    part = u[begin : begin + size]
    if float(np.std(part)) < 0.1 * float(np.std(u)) or float(np.std(part)) == 0.0:
        return []
    return [
        f"the output stands still {_between(recording, begin, size)} while the input moves: "
        "does the encoder work, is the axis enabled, or does friction hold it? Leave that part out with --span"
    ]


def _clipped(name: str, values: FloatArray, unit: str) -> list[str]:
    """Warnings about many samples exactly at an end of the range."""
    if len(np.unique(values[:LOOK])) <= LEVELS:
        return []
    found = []
    for end, word in ((float(values.max()), "highest"), (float(values.min()), "lowest")):
        part = float(np.mean(values == end))
        if part > CLIPPED and np.count_nonzero(np.diff((values == end).astype(np.int8))) > 3:
            found.append(f"the {name} lies at its {word} value, {end:.4g} {unit}, in {100 * part:.0f} % of the samples: is it saturated?")
    return found
