"""NPZ and MAT: ``t`` or ``time`` (s), ``u`` or ``voltage``, ``y`` or ``position``, ``fs`` (Hz), ``u_unit``, ``y_unit``,
``r`` or ``reference``, ``axes``, ``seq``; two-dimensional u and y hold several axes."""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadRecording
from xy_sysid.imports.table import Table, axis_names
from xy_sysid.recording import Recording
from xy_sysid.stream import FloatArray

Arrays = Mapping[str, NDArray[Any]]
COPY = "Take another copy of the file."
V73 = "Save it in MATLAB with save(name, '-v7')."
DAMAGED = (OSError, ValueError, EOFError, KeyError, TypeError, IndexError, NotImplementedError, zipfile.BadZipFile, zlib.error, struct.error)


def read_npz(path: Path) -> Arrays:
    """The arrays of an .npz file; raises BadRecording."""
    try:
        with path.open("rb") as raw:
            file = np.load(raw, allow_pickle=False)
            if not isinstance(file, np.lib.npyio.NpzFile):
                raise BadRecording(path, "one bare array, not an .npz", "Save named arrays with numpy.savez.")
            return {name: file[name] for name in file.files}
    except DAMAGED as error:
        raise BadRecording(path, f"not readable as .npz ({_line(error)})", COPY) from None


def read_mat(path: Path) -> Arrays:
    """The variables of a MATLAB file up to version 7; those of its only struct, if it has nothing else."""
    import scipy.io

    with path.open("rb") as file:
        head = file.read(128)
    if head.startswith((b"MATLAB 7.3", b"\x89HDF")):
        raise BadRecording(path, "a MATLAB file of version 7.3 (HDF5), which is not read here", V73)
    try:
        content = scipy.io.loadmat(str(path), squeeze_me=True, struct_as_record=True)
    except (*DAMAGED, scipy.io.matlab.MatReadError) as error:
        raise BadRecording(path, f"not readable as .mat ({_line(error)})", COPY) from None
    found = {name: np.asarray(value) for name, value in content.items() if not name.startswith("__")}
    if len(found) == 1:
        (only,) = found.values()
        if only.dtype.names and only.size == 1:
            return {name: np.asarray(only[name].item()) for name in only.dtype.names}
    return found


def _line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:120]


def table(path: Path, arrays: Arrays, input_key: str | None, output_key: str | None) -> Table:
    """What the arrays say; raises BadRecording that names the arrays there are."""
    has = f"it has {', '.join(arrays) or 'nothing'}"
    chosen = []
    for key, names in ((input_key, ("u", "voltage")), (output_key, ("y", "position"))):
        name = next((name for name in ((key,) if key else names) if name in arrays), None)
        if name is None:
            option = "--input-key" if names[0] == "u" else "--output-key"
            raise BadRecording(path, f"no array {key or ' or '.join(names)}; {has}", f"Name it with {option}.")
        chosen.append(name)
    time_name = next((name for name in ("t", "time") if name in arrays), None)
    time = None if time_name is None else _vector(path, time_name, arrays[time_name])
    fs = _vector(path, "fs", arrays["fs"]) if "fs" in arrays else np.empty(0)
    rows = None if time is None else len(time)
    inputs, outputs = (_matrix(path, name, arrays[name], rows) for name in chosen)
    if inputs.shape[1] != outputs.shape[1]:
        raise BadRecording(path, f"{chosen[0]} has {inputs.shape[1]} axes and {chosen[1]} {outputs.shape[1]}", "Give one column per axis in both.")
    reference_name = next((name for name in ("r", "reference") if name in arrays), None)
    reference = None if reference_name is None else _matrix(path, reference_name, arrays[reference_name], rows)
    names = np.atleast_1d(arrays["axes"]).astype(str).tolist() if "axes" in arrays else []
    axes = tuple(name.strip() for name in names) if len(names) == inputs.shape[1] else axis_names(inputs.shape[1])
    return Table(
        axes=axes,
        time=time,
        fs=float(fs[0]) if fs.size else None,
        seq=_vector(path, "seq", arrays["seq"]) if "seq" in arrays else None,
        input=inputs,
        output=outputs,
        reference=reference if reference is not None and reference.shape == outputs.shape else None,
        input_unit=_unit(arrays, chosen[0], "u_unit", "V"),
        output_unit=_unit(arrays, chosen[1], "y_unit", "m"),
    )


def _unit(arrays: Arrays, name: str, usual_name: str, usual: str) -> str:
    for key in (f"{name}_unit", usual_name):
        if key in arrays and arrays[key].size == 1:
            return str(arrays[key].item()).strip() or usual
    return usual


def _vector(path: Path, name: str, values: NDArray[Any]) -> FloatArray:
    return _real(path, name, values).ravel()


def _real(path: Path, name: str, values: NDArray[Any]) -> FloatArray:
    if values.dtype.kind not in "fiub":
        raise BadRecording(path, f"{name} holds {values.dtype}, not real numbers", "Store real numbers.")
    return np.asarray(values, dtype=np.float64)


def _matrix(path: Path, name: str, values: NDArray[Any], rows: int | None) -> FloatArray:
    """(n, axes): columns, turned if it came as rows."""
    values = _real(path, name, values)
    if values.ndim > 2 or values.ndim == 0:
        raise BadRecording(path, f"{name} has {values.ndim} dimensions", "Give samples, or samples x axes.")
    if values.ndim == 1:
        return values[:, None]
    turned = values.shape[1] == rows and values.shape[0] != rows if rows is not None else values.shape[1] > values.shape[0]
    return np.ascontiguousarray(values.T if turned else values)


def content(recording: Recording) -> dict[str, Any]:
    """What is written to .npz and .mat: enough to get the same recording back."""
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
    """Exact, not compressed."""
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **content(recording))


def write_mat(path: Path, recording: Recording) -> None:
    """MATLAB version 5."""
    import scipy.io

    fields = content(recording)
    fields["axes"] = np.array(fields["axes"], dtype=object)
    fields["seq"] = recording.seq.astype(np.float64)
    scipy.io.savemat(str(path), fields, oned_as="column")
