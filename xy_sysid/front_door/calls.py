"""Wraps a public function: equivalent arguments are converted, and a wrong call raises one line with the right call."""

from __future__ import annotations

import functools
import inspect
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from xy_sysid.errors import BadInput
from xy_sysid.front_door.types import in_words, is_a
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.recording import Recording, Run

LONGEST = 60  # characters of a value that is quoted


def for_people(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """The function with conversion of its arguments (``meant``), in either order if only one order is possible.

    name: the public name, for example xy.fit. The result raises BadInput for arguments of a wrong type, too many, or too few.
    """
    signature, hints = inspect.signature(function), _hints(function)
    usage = _usage(name, signature)

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        given = _in_order(given, [hints.get(item) for item in signature.parameters])
        try:
            bound = signature.bind(*given, **named)
        except TypeError as problem:
            raise BadInput(f"the call of {name}", str(problem), usage, "Call it like that.") from None
        for argument, value in bound.arguments.items():
            kind = signature.parameters[argument].kind
            if kind is inspect.Parameter.VAR_POSITIONAL:
                bound.arguments[argument] = tuple(_checked(f"{argument} of {name}", item, hints.get(argument, Any), usage) for item in value)
            elif kind is not inspect.Parameter.VAR_KEYWORD:
                bound.arguments[argument] = _checked(f"{argument} of {name}", value, hints.get(argument, Any), usage)
        return function(*bound.args, **bound.kwargs)

    return call


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """The annotated types of the arguments; a type from a library that only a type checker imports counts as any."""
    found: dict[str, Any] = {}
    for name, text in function.__annotations__.items():
        try:
            found |= get_type_hints(types.SimpleNamespace(__annotations__={name: text}), globalns=function.__globals__)
        except (NameError, AttributeError):
            found[name] = Any
    return found


def pictures(module: types.ModuleType) -> types.ModuleType:
    """The module with each of its public functions wrapped."""
    shown = types.ModuleType("xy_sysid.plot", module.__doc__)
    for name, value in vars(module).items():
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_"):
            setattr(shown, name, for_people(value, f"xy.plot.{name}"))
    return shown


def meant(value: Any, wanted: Any) -> Any:
    """Converts a value to the wanted type, item by item in a list: a path to the content of the file, a run to its response."""
    kinds = get_args(wanted) if get_origin(wanted) is not None else (wanted,)
    if isinstance(value, list | tuple) and Run in kinds:
        return [meant(item, wanted) for item in value]
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


def _checked(what: str, value: Any, wanted: Any, usage: str) -> Any:
    if is_a(value, wanted):
        return value
    value = meant(value, wanted)
    if is_a(value, wanted):
        return value
    raise BadInput(what, _quoted(value), in_words(wanted), f"Call it as {usage}.")


def _in_order(given: tuple[Any, ...], wanted: list[Any]) -> tuple[Any, ...]:
    """The first two arguments exchanged, if they fit only so."""
    if len(given) < 2 or len(wanted) < 2 or None in wanted[:2]:
        return given
    first, second = given[:2]
    stand = is_a(first, wanted[0]) or is_a(second, wanted[1])
    return (second, first, *given[2:]) if not stand and is_a(second, wanted[0]) and is_a(first, wanted[1]) else given


def _quoted(value: Any) -> str:
    """Short values with their type; for others only the type."""
    words = repr(value) if isinstance(value, str | int | float | bool | list | dict | tuple | None) else ""
    kind = type(value).__name__
    return f"{kind} {words}" if 0 < len(words) <= LONGEST else kind


def _usage(name: str, signature: inspect.Signature) -> str:
    """The call with the required arguments, and dots for the others."""
    needed, more = [], False
    for item in signature.parameters.values():
        if item.kind is inspect.Parameter.VAR_POSITIONAL:
            needed.append(f"{item.name}...")
        elif item.default is inspect.Parameter.empty and item.kind is not inspect.Parameter.VAR_KEYWORD:
            needed.append(item.name)
        else:
            more = True
    return f"{name}({', '.join([*needed, '...'] if more else needed)})"
