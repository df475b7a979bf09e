"""NPZ and MAT: ``t`` or ``time`` (s), ``u`` or ``voltage``, ``y`` or ``position``, ``fs`` (Hz), ``u_unit``, ``y_unit``,
``r`` or ``reference``, ``axes``, ``seq``; two-dimensional u and y hold several axes. Other files are sheets of columns."""

from __future__ import annotations

import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording
from xy_sysid.imports import instants
from xy_sysid.imports.foreign_units import MOTIONS, Unit, to_si
from xy_sysid.imports.limits import COPY, MOST_COLUMNS, fits
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.sheet import Column, Sheet
from xy_sysid.imports.sheet_table import same_unit, scaled
from xy_sysid.imports.table import ONE_UNIT, Table, as_they_stand, axis_names, places_of
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording

Arrays = Mapping[str, NDArray[Any]]
DAMAGED = (
    *(OSError, ValueError, EOFError, KeyError, TypeError, IndexError, NotImplementedError, SyntaxError),
    *(tokenize.TokenError, zipfile.BadZipFile, zlib.error, struct.error),
)
INPUTS, OUTPUTS, REFERENCES = ("u", "voltage", "InputData"), ("y", "position", "OutputData"), ("r", "reference")
TIMES = ("t", "time", "SamplingInstants")
INPUT_UNITS, OUTPUT_UNITS = ("u_unit", "voltage_unit", "InputData_unit", "InputUnit"), ("y_unit", "position_unit", "OutputData_unit", "OutputUnit")
TIME_UNITS = ("t_unit", "TimeUnit")
RATES = ("fs", "samplingrate", "samplerate", "samplingfrequency", "samplefrequency", "fsample", "rate")  # in the spelling of ``_plain``
PERIODS = ("ts", "dt", "samplingperiod", "sampleperiod", "samplingtime", "sampletime", "tsample", "samplinginterval", "sampleinterval")
QUOTED = re.compile(r'"([^"]*)"')
DULL = re.compile(r"Model Root|(In|Out)\d+", re.IGNORECASE)  # parts of a block's path that carry no information
VALUES, LABELS, UNITS = ("Data", "data", "values", "Values"), ("Name", "name", "label", "Label", "Path"), ("Unit", "unit", "Units", "units")


def read_npz(path: Path) -> Arrays:
    """The arrays of an .npz file. Raises BadRecording if they do not fit in memory, or if an array is smaller than its header says."""
    try:
        with path.open("rb") as raw:
            if raw.read(6) == b"\x93NUMPY":
                raise BadRecording(path, "one bare array, not an .npz", "Save named arrays with numpy.savez.")
            raw.seek(0)
            with zipfile.ZipFile(raw) as archive:
                if len(archive.infolist()) > MOST_COLUMNS:
                    raise BadRecording(path, f"{len(archive.infolist())} arrays, and {MOST_COLUMNS} are read at most", "Store the signals alone.")
                fits(path, float(sum(member.file_size for member in archive.infolist())))
                return {member.filename.removesuffix(".npy"): _member(path, archive, member) for member in archive.infolist()}
    except DAMAGED as error:
        raise BadRecording(path, f"not readable as .npz ({_line(error)})", COPY) from None


def _member(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """One array; its header is read first, because it sets the allocated memory."""
    form = np.lib.format
    with archive.open(member) as file:
        version = form.read_magic(file)
        shape, _, kind = form.read_array_header_1_0(file) if version == (1, 0) else form.read_array_header_2_0(file)
    if not kind.hasobject and float(np.prod([float(size) for size in shape])) * kind.itemsize > member.file_size:
        raise BadRecording(path, f"{member.filename} says it holds {shape} numbers, and it holds fewer", COPY)
    with archive.open(member) as file:
        return np.asarray(form.read_array(file, allow_pickle=False))


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]


def group(path: Path, leaves: Arrays) -> Arrays:
    """The leaves of the only struct with the contract's names, without the struct's name; otherwise all leaves. Raises BadRecording for several."""
    if _has(leaves):
        return leaves
    inside: dict[str, dict[str, NDArray[Any]]] = {}
    for name, value in leaves.items():
        place, _, last = name.rpartition(".")
        inside.setdefault(place, {})[last] = value
    found = [place for place, content in inside.items() if place and _has(content)]
    if len(found) > 1:
        raise BadRecording(path, f"several recordings: {', '.join(found)}", f"Choose with --map input={found[0]}.u,output={found[0]}.y")
    if found:
        return inside[found[0]]
    places = {name.partition(".")[0] for name in leaves}
    return {name.partition(".")[2]: value for name, value in leaves.items()} if len(places) == 1 and all("." in name for name in leaves) else leaves


def _has(arrays: Arrays) -> bool:
    return any(name in arrays for name in INPUTS) and any(name in arrays for name in OUTPUTS)


def table(sheet: Sheet, reading: Reading, notes: list[str]) -> Table | None:
    """The table of arrays with the contract's names; None if there are none, or if columns were chosen."""
    arrays, path = sheet.arrays, sheet.path
    if arrays is None or reading.columns:
        return None
    time_name = next((name for name in TIMES if name in arrays and (arrays[name].size or name != TIMES[-1])), None)
    stamps = None if time_name is None else _vector(path, time_name, arrays[time_name])
    inputs, outputs, reference, axes = _sides(path, arrays, None if stamps is None else len(stamps), reading.axes)
    time, fs = _time(path, arrays, reading, (time_name, stamps), notes)
    if str(arrays.get("InterSample", np.array("zoh")).ravel()[:1]).find("foh") >= 0:
        notes.append("the file says that its input is linear between samples (foh): fit it with --set hold=none")
    input_unit, output_unit = (_unit(arrays, names, usual) for names, usual in ((INPUT_UNITS, "V"), (OUTPUT_UNITS, "m")))
    u, input_si = _si(("input", inputs, input_unit), path, axes, reading, notes)
    y, output_si = _si(("output", outputs, output_unit), path, axes, reading, notes)
    if reference is not None:
        r, reference_si = _si(("reference", reference, output_unit), path, axes, reading, [])
        reference = r if same_unit(reading, reference_si, output_si, notes) else None
    return Table(
        axes=axes,
        time=time,
        fs=fs,
        seq=_vector(path, "seq", arrays["seq"]) if "seq" in arrays and reading.rate is None else None,
        input=u,
        output=y,
        reference=reference,
        input_unit=input_si.name,
        output_unit=output_si.name,
        measured=output_si.quantity if output_si.quantity in MOTIONS else "position",
    )


def _sides(
    path: Path, arrays: Arrays, rows: int | None, wanted: Sequence[str] | None
) -> tuple[FloatArray, FloatArray, FloatArray | None, tuple[str, ...]]:
    """Input, output and reference (only if it has their shape), (n, axes) each, and the names of the chosen axes."""
    input_name, output_name = (next(name for name in names if name in arrays) for names in (INPUTS, OUTPUTS))
    inputs, outputs = (_matrix(path, name, arrays[name], rows) for name in (input_name, output_name))
    if inputs.shape[1] != outputs.shape[1]:
        raise BadRecording(path, f"{input_name} has {inputs.shape[1]} axes and {output_name} {outputs.shape[1]}", "Give one column per axis in both.")
    reference_name = next((name for name in REFERENCES if name in arrays), None)
    reference = None if reference_name is None else _matrix(path, reference_name, arrays[reference_name], rows)
    names = np.atleast_1d(arrays["axes"]).astype(str).tolist() if "axes" in arrays else []
    every = tuple(name.strip() for name in names) if len(names) == inputs.shape[1] else axis_names(inputs.shape[1])
    reference = reference if reference is not None and reference.shape == outputs.shape else None
    places = places_of(every, wanted)  # units of omitted axes do not matter
    axes = tuple(every[place] for place in places)
    return inputs[:, places], outputs[:, places], None if reference is None else reference[:, places], axes


def _time(
    path: Path, arrays: Arrays, reading: Reading, stamps: tuple[str | None, FloatArray | None], notes: list[str]
) -> tuple[FloatArray | None, float | None]:
    """Instants, s, and rate, Hz, as far as the file gives them. stamps: name and numbers of the time."""
    (name, time), fs = stamps, rate_of(arrays)
    if time is None and fs is None and reading.rate is None:
        said = next((f"{name} ({value})" for name, value in arrays.items() if _plain(name) in RATES), "fs")
        raise BadRecording(path, f"neither a time column nor a usable {said}", "Add t in seconds or fs in Hz, or give --rate.")
    if reading.rate is not None:
        notes += as_they_stand(reading.rate, None if time is None else name)
        return None, reading.rate
    if time is None:
        notes += as_they_stand(fs, None)
        return None, fs
    return instants.stamps(path, Column(name or "time", _unit(arrays, TIME_UNITS, ""), time), reading, notes).seconds(), fs


def _si(side: tuple[str, FloatArray, str], path: Path, axes: tuple[str, ...], reading: Reading, notes: list[str]) -> tuple[FloatArray, Unit]:
    """(n, axes) in SI and the unit. side: role, values (n, axes), unit in the file."""
    role, values, text = side
    columns: list[FloatArray] = []
    units: list[Unit] = []
    said: list[str] = []
    for place, axis in enumerate(axes):
        one, own = scaled(values[:, place], reading.unit(role, axis) or text, reading.scale(role, axis), f"the {role} of {axis}", said)
        one, unit = to_si(one, own, f"the {role}", said)
        columns.append(one)
        units.append(unit)
    if len({unit.name for unit in units}) > 1:
        given = ", ".join(sorted({unit.name for unit in units}))
        raise BadRecording(path, f"axes in different units ({given})", ONE_UNIT)
    notes += dict.fromkeys(said)
    return np.column_stack(columns), units[0]


def rate_of(arrays: Arrays) -> float | None:
    """Hz, from a valid rate or period in the file; None without one."""
    plain = {_plain(name): value for name, value in arrays.items()}
    for names, invert in ((RATES, False), (PERIODS, True)):
        for name in names:
            values = plain.get(name)
            if values is not None and values.size == 1 and values.dtype.kind in "fiub":
                value = float(values.ravel()[0])
                if np.isfinite(value) and value > 0:
                    return 1.0 / value if invert else value
    return None


def _plain(name: str) -> str:
    """The spelling of a rate or a period in the lists above: samplingrate for Sampling_Rate_Hz."""
    return re.sub(r"[_ ](hz|sec)$|(?<=\w\w)[_ ]s$|[_ ]", "", name.lower())


def sheet(path: Path) -> Sheet:
    """The arrays of an .npz file as columns."""
    return sheet_of(path, group(path, read_npz(path)))


def sheet_of(path: Path, arrays: Arrays) -> Sheet:
    """Every vector, and every column of a matrix (``data:3`` is its third), as a column."""
    columns: list[Column] = []
    rates: Arrays = {name.rpartition(".")[2]: value for name, value in arrays.items()}
    for name, value in arrays.items():
        unit = _unit_beside(arrays, name)
        shown = _label(arrays, name)
        if value.dtype.kind not in "fiub" or value.ndim > 2 or value.size < 2:
            continue
        if value.ndim == 1 or 1 in value.shape:
            columns.append(Column(shown, unit, np.asarray(value, np.float64).ravel()))
            continue
        turned = value.T if value.shape[1] > value.shape[0] else value
        for place in range(min(turned.shape[1], 64)):
            columns.append(Column(f"{shown}:{place + 1}", unit, np.asarray(turned[:, place], np.float64)))
    return Sheet(path=path, columns=tuple(short(columns)), kind="array", fs=rate_of(rates), arrays=arrays if _has(arrays) else None)


def short(columns: list[Column]) -> list[Column]:
    """The columns without the names of structs or groups, if the names stay unique."""
    last = [column.name.rpartition(".")[2] for column in columns]
    return [
        replace(one, name=name, full=one.name) if last.count(name) == 1 and name != one.name else one for one, name in zip(columns, last, strict=True)
    ]


def _label(arrays: Arrays, name: str) -> str:
    """The label of a struct with a name and values: the informative part of its name, or time for a struct X."""
    place, _, last = name.rpartition(".")
    if last not in VALUES:
        return name
    for label in LABELS:
        said = str(arrays[f"{place}.{label}"].ravel()[0]) if f"{place}.{label}" in arrays and arrays[f"{place}.{label}"].size else ""
        parts = [part for part in QUOTED.findall(said) or said.split("/") if part and not DULL.fullmatch(part)]
        if parts and sum(str(value.ravel()[0]) == said for key, value in arrays.items() if key.rpartition(".")[2] == label and value.size) == 1:
            return parts[-1].strip().replace(".", " ")
    if place.rpartition(".")[2] == "X":
        return "time"
    return name if place.endswith(")") else place or name


def _unit_beside(arrays: Arrays, name: str) -> str:
    place, _, last = name.rpartition(".")
    beside = [f"{name}_unit", *(f"{place}.{one}" for one in UNITS if place and last in VALUES)]
    beside += {"u": ["u_unit"], "y": ["y_unit"]}.get(name, [])
    return next((str(arrays[one].ravel()[0]).strip() for one in beside if one in arrays and arrays[one].size), "")


def _unit(arrays: Arrays, names: Sequence[str], usual: str) -> str:
    for key in names:
        if key in arrays and arrays[key].size and arrays[key].dtype.kind in "US":
            return str(arrays[key].ravel()[0]).strip() or usual
    return usual


def _vector(path: Path, name: str, values: NDArray[Any]) -> FloatArray:
    return _real(path, name, values).ravel()


def _real(path: Path, name: str, values: NDArray[Any]) -> FloatArray:
    if values.dtype.kind not in "fiub":
        raise BadRecording(path, f"{name} holds {values.dtype}, not real numbers", "Store real numbers.")
    return np.asarray(values, dtype=np.float64)


def _matrix(path: Path, name: str, values: NDArray[Any], rows: int | None) -> FloatArray:
    """(n, axes): columns; transposed if given as rows."""
    values = _real(path, name, values)
    if values.ndim > 2 or values.ndim == 0:
        raise BadRecording(path, f"{name} has {values.ndim} dimensions", "Give samples, or samples x axes.")
    if values.ndim == 1:
        return values[:, None]
    turned = values.shape[1] == rows and values.shape[0] != rows if rows is not None else values.shape[1] > values.shape[0]
    return np.ascontiguousarray(values.T if turned else values)


def content(recording: Recording) -> dict[str, Any]:
    """The arrays for .npz and .mat, from which ``load`` restores the recording."""
    known = {
        "t": recording.time,
        "u": recording.voltage,
        "y": recording.position,
        "fs": recording.sampling_rate,
        "u_unit": recording.input_unit,
        "y_unit": recording.output_unit,
        "axes": list(recording.axes),
        "seq": recording.seq,
    }
    return known if recording.reference is None else {**known, "r": recording.reference}


def write_npz(path: Path, recording: Recording) -> None:
    """Write uncompressed numbers in full precision."""
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **content(recording))


def write_mat(path: Path, recording: Recording) -> None:
    """Write a MATLAB version 5 file."""
    import scipy.io

    fields = content(recording)
    fields["axes"] = np.array(fields["axes"], dtype=object)
    fields["seq"] = recording.seq.astype(np.float64)
    scipy.io.savemat(str(path), fields, oned_as="column")
