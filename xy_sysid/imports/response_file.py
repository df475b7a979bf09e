"""A file with a measured frequency response: frequency, and magnitude with phase or real with imaginary part, without time.

The headers give the meaning of the numbers, unless the numbers contradict them; every choice is noted. If nothing else shows whether a
magnitude is in dB, the phase does: for a minimum-phase system it is 90 degrees for each 20 dB per decade (Bode 1945, ch. XIV).
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports import csv
from xy_sysid.imports.foreign_units import TURN, unit_of
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.sheet import Column, Sheet, spoken
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.given import Known, given_response
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Origin
from xy_sysid.settings import unknown_name

NAMES: Mapping[str, str] = {
    "frequency": "frequency freq f omega w hz",
    "magnitude": "magnitude mag h gain amplitude ampl abs db ratio",
    "phase": "phase ph arg angle argument",
    "real": "real re",
    "imag": "imag imaginary im",
    "coherence": "coherence coh gamma",
    "sigma": "sigma std deviation uncertainty",
}
RADIANS, DEGREES = {"rad", "rads", "radian", "radians"}, {"deg", "degree", "degrees"}
UNITS = re.compile(r"[^\W\d_]+|[%°]")  # of m/s^2/V they are m, s and V
DECIBEL = re.compile(r"(?i)(?<![a-z])db(?![a-z])")
HERTZ = {"hz": 1.0, "khz": 1e3, "MHz": 1e6, "mhz": 1e-3}
JUMP = 0.5  # rad; a phase whose usual step from line to line is larger, modulo a turn, is not smooth
EXAMPLE = "Name them with --map frequency=1,magnitude=2,phase=3, or real= and imag= (see xy-sysid columns FILE)."


def sheet(path: Path) -> Sheet:
    """The columns of the file."""
    return csv.sheet(path)


def responses(path: Path, sheet: Sheet, reading: Reading, known: Mapping[str, Any] | None = None) -> dict[str, FrequencyResponse]:
    """The response of each axis; one axis x if the file names none. known: fields of ``Known`` that the file does not have.

    Raises BadRecording or BadInput, which name the missing part.
    """
    columns = {role: column for role in NAMES if (column := column_of(sheet, role, reading)) is not None}
    _complete(path, sheet, columns)
    axes = next((column for column in sheet.columns if column.words and spoken(column.name) == ("axis",)), None)
    words = np.array(axes.words if axes is not None else ["x"] * len(columns["frequency"].values))
    names = dict.fromkeys(words.tolist())
    found = {name: _response(columns, words == name, name, reading, known or {}) for name in names}
    return found if reading.axes is None else {name: found[name] for name in _chosen(reading.axes, found)}


def frf_from(
    source: Path | str | Any,
    response: Any = None,
    *,
    axis: str | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    **known: Any,
) -> FrequencyResponse:
    """A frequency response that was measured elsewhere, for ``fit``, ``plot`` and other functions that need no samples.

    source:   a file, or (m,) frequencies in Hz with ``response``, (m,) complex
    axis:     its name, or the one to read from a file of several; units: {"input": "V", "output": "rad"}, for a file also {"phase": "deg"}
    columns:  of a file, as for ``--map``: {"frequency": "1", "magnitude": "2", "phase": "3"}
    known:    sigma, (m,) standard deviation of the complex error; coherence, (m,), with its averages; sampling_rate, Hz
    The interpretation of the file is in ``origin.notes``. Raises BadInput or BadRecording.
    """
    names = [field.name for field in dataclasses.fields(Known)]
    for name in known:
        if name not in names:
            raise unknown_name(name, names, "frf_from")
    if not isinstance(source, str | Path):
        told = units or {}
        return given_response(source, response, Known(**known), (told.get("input", "in"), told.get("output", "out")), Origin(axis=axis or ""))
    from xy_sysid.imports.registry import format_of, sheet_of

    path = Path(source)
    try:
        content = sheet_of(path, format_of(path))
    except OSError as error:
        raise BadRecording(path, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
    found = responses(path, content, Reading(columns=columns or {}, units=units or {}, axes=None if axis is None else (axis,)), known)
    if len(found) > 1:
        raise BadInput("frequency response", f"of {len(found)} axes", "one axis", f"Choose one with axis=: {', '.join(found)}.")
    return next(iter(found.values()))


def column_of(sheet: Sheet, role: str, reading: Reading) -> Column | None:
    """The column of a role: the chosen one, or one whose first word is a name of the role; None if there is none."""
    if role in reading.columns:
        return sheet.find(reading.columns[role])
    known = NAMES[role].split()
    return next((sheet.usable(one) for one in sheet.columns if not one.words and spoken(one.name) and spoken(one.name)[0] in known), None)


def _complete(path: Path, sheet: Sheet, columns: Mapping[str, Column]) -> None:
    if any("psd" in spoken(one.name) for one in sheet.columns) and "phase" not in columns:
        act = "Record the acceleration itself, as raw data, together with the command."
        raise BadRecording(path, "power spectra without a phase, which are not a frequency response", act)
    missing = [role for role in ("frequency",) if role not in columns]
    if not ({"magnitude", "phase"} <= set(columns) or {"real", "imag"} <= set(columns)):
        missing.append("magnitude with phase, or real with imag")
    if missing:
        raise BadRecording(path, f"no {' and no '.join(missing)}; {sheet.names()}", EXAMPLE)


def _chosen(axes: Any, found: Mapping[str, FrequencyResponse]) -> list[str]:
    for name in axes:
        if name not in found:
            raise BadInput("axis", name, ", ".join(found), "Choose some of these.")
    return list(axes)


def _response(columns: Mapping[str, Column], rows: Any, axis: str, reading: Reading, given: Mapping[str, Any]) -> FrequencyResponse:
    values = {role: column.values[rows] for role, column in columns.items()}
    notes: list[str] = []
    frequency = _hertz(columns["frequency"], values["frequency"], reading, notes)
    if {"real", "imag"} <= set(values):
        response = values["real"] + 1j * values["imag"]
        notes.append("the response is read as real and imaginary part")
    else:
        phase = _radians(columns["phase"], values["phase"], reading, notes)
        size = _linear(columns["magnitude"], (frequency, values["magnitude"], phase), reading, notes)
        response = size * np.exp(1j * phase)
    known = dataclasses.replace(Known(sigma=values.get("sigma"), coherence=values.get("coherence"), sampling_rate=reading.rate), **given)
    units = reading.unit("input", axis) or "in", reading.unit("output", axis) or "out"
    return given_response(frequency, response, known, units, Origin(axis=axis, notes=tuple(notes)))


def _hertz(column: Column, values: FloatArray, reading: Reading, notes: list[str]) -> FloatArray:
    last = re.split(r"[\W_]+", column.name)[-1]
    said = reading.units.get("frequency") or column.unit or (last if last.lower() in HERTZ else "")
    words = spoken(said or column.name)
    angular = bool(RADIANS & set(words)) or said == "1/s" or (not said and words[0] in ("omega", "w"))
    scale = 1.0 / TURN if angular else HERTZ.get(said, HERTZ.get(said.lower())) if said else 1.0
    if scale is None:
        raise _unknown("frequency", said, "Hz, kHz, MHz or rad/s")
    notes.append(f"frequencies are in {'rad/s' if angular else 'Hz'}{'' if said else ', as nothing else is said'}")
    return values * scale


def _radians(column: Column, values: FloatArray, reading: Reading, notes: list[str]) -> FloatArray:
    """Phases in rad. A header of rad is ignored if the phase would jump by turns from line to line."""
    told = reading.units.get("phase", "")
    said = told or column.unit
    words = {*spoken(said), *(() if told else spoken(column.name))}
    degrees, radians = bool(words & DEGREES) or "°" in (said or column.name), bool(words & RADIANS)
    if not degrees and not radians and (told or unit_of(said).quantity != "unknown"):  # brackets may hold a remark: Phase (B-A)
        raise _unknown("phase", said, "deg or rad")
    finite = values[np.isfinite(values)]
    within = float(np.max(np.abs(finite), initial=0.0)) <= TURN
    smooth = float(np.median(np.abs(np.angle(np.exp(1j * np.diff(finite)))))) < JUMP if finite.size > 1 else True
    why = ""
    if not told and radians and not within and not smooth:
        degrees, why = True, ": the header says rad, and in rad the phase would jump by whole turns from line to line (--unit phase=rad overrides)"
    elif not degrees and not radians:
        degrees, why = not within, ", by their size"
    notes.append(f"phases are in {'degrees' if degrees else 'radians'}{why}")
    return np.deg2rad(values) if degrees else values


def _unknown(what: str, said: str, allowed: str) -> BadInput:
    return BadInput(f"the unit of the {what}", repr(said), allowed, f"Give it with --unit {what}={allowed.split()[0].rstrip(',')}.")


def _linear(column: Column, lines: tuple[FloatArray, FloatArray, FloatArray], reading: Reading, notes: list[str]) -> FloatArray:
    """Linear magnitudes, converted if they are in dB. lines: frequency, Hz, magnitude, phase, rad."""
    frequency, values, phase = lines
    told, units = reading.units.get("magnitude", ""), UNITS.findall(column.unit)
    if told or DECIBEL.search(f"{column.name} {column.unit}"):
        decibels, why = (told.lower() == "db" if told else True), ""
    elif bool(np.any(values[np.isfinite(values)] < 0)):
        decibels, why = True, ", as some are negative"
    elif units and all(unit_of(one).quantity != "unknown" for one in units):
        decibels, why = False, f", in {column.unit}"
    else:
        decibels, why = _slope_says_decibels(frequency, values, phase), ", as their slope fits the phase then"
    notes.append(f"magnitudes are {'in dB' if decibels else 'linear'}{why}")
    return np.asarray(10.0 ** (values / 20.0) if decibels else values)


def _slope_says_decibels(frequency: FloatArray, values: FloatArray, phase: FloatArray) -> bool:
    good = np.isfinite(frequency) & np.isfinite(values) & np.isfinite(phase) & (frequency > 0) & (values > 0)
    if int(np.sum(good)) < 4:
        return False
    x = np.log(frequency[good])
    slopes = (np.gradient(np.log(10.0) / 20.0 * values[good], x), np.gradient(np.log(values[good]), x))
    off = [float(np.median(np.abs(np.angle(np.exp(1j * (phase[good] - 0.5 * np.pi * slope)))))) for slope in slopes]
    return off[0] < off[1]
