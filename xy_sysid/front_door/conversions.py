"""Converts what people pass to what a public function takes: a path, a run, a list of numbers."""

from __future__ import annotations

import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Union, get_args, get_origin

import numpy as np

from xy_sysid.front_door.types import is_a
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.recording import Recording, Run

MODEL_FILES = (".yaml", ".yml")


def kinds_of(wanted: Any) -> tuple[Any, ...]:
    """The alternatives of a type, and the types of the items of a list."""
    return get_args(wanted) if get_origin(wanted) is not None else (wanted,)


def accepted(wanted: Any) -> Any:
    """The type together with those that are converted to it."""
    kinds = kinds_of(wanted)
    more = (Run, Recording, Path) if FrequencyResponse in kinds else (Path,) if {Run, Recording, AnyModel} & set(kinds) else ()
    return Union[(wanted, *more)] if more else wanted


def could_be(value: Any, wanted: Any) -> bool:
    """Whether a value has the wanted type, or would be converted to it; files of models and of data differ by their ending."""
    if is_a(value, wanted):
        return True
    kinds = kinds_of(wanted)
    if isinstance(value, str | Path):
        return AnyModel in kinds if Path(value).suffix in MODEL_FILES else bool({Run, Recording, FrequencyResponse} & set(kinds))
    return isinstance(value, Run | Recording) and FrequencyResponse in kinds


def meant(value: Any, wanted: Any) -> Any:
    """Converts a value to the wanted type, item by item in a list: a path to the content of the file, a run to its response, a list to an array."""
    kinds = kinds_of(wanted)
    if isinstance(value, list | tuple) and Run in kinds:
        return [meant(item, wanted) for item in value]
    if isinstance(value, list | tuple):
        return next((made for kind in _alternatives(wanted) if (made := _of_list(value, kind)) is not None), value)
    if FrequencyResponse in kinds:
        return _response(value)
    if not isinstance(value, str | Path):
        return value
    if Run in kinds or Recording in kinds:
        from xy_sysid.imports import load

        return load(value)
    if AnyModel in kinds:
        from xy_sysid.files.models import load_model

        return load_model(value)
    return value


def _alternatives(wanted: Any) -> Iterator[Any]:
    if get_origin(wanted) in (Union, types.UnionType):
        yield from get_args(wanted)
    else:
        yield wanted


def _of_list(value: list[Any] | tuple[Any, ...], wanted: Any) -> Any:
    """The list as a tuple or an array; None if its items have other types."""
    kind, parts = get_origin(wanted), get_args(wanted)
    if kind is np.ndarray and value:
        try:
            made = np.array(value)
        except ValueError:  # rows of different lengths
            return None
        return made.astype(get_args(parts[1])[0]) if is_a(made, wanted) else None
    if kind is tuple:
        each = parts[:1] * len(value) if parts[1:] == (...,) else parts
        items = tuple(map(meant, value, each)) if len(value) == len(each) else ()
        return items if is_a(items, wanted) else None
    return None


def _response(value: Any) -> Any:
    """The frequency response of a run, a recording or a file."""
    from xy_sysid.fitting.of_run import frf

    if isinstance(value, str | Path):
        from xy_sysid.imports import load
        from xy_sysid.imports.registry import format_of
        from xy_sysid.imports.response_file import frf_from

        path = Path(value)
        if path.is_file() and format_of(path).kind == "response":
            return frf_from(path)
        value = load(path)
    return frf(value) if isinstance(value, Run | Recording) else value
