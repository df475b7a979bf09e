"""Wraps public functions, constructors and methods: equivalent arguments are converted, and a wrong call raises one line with the right call."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import sys
import types
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.front_door.conversions import accepted, could_be, kinds_of, meant
from xy_sysid.front_door.ranges import FINITE, OWN, RANGES, outside
from xy_sysid.front_door.types import in_words, is_a
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import unknown_name

LONGEST = 60  # characters of a value that is quoted
INSIDE = {"xy_sysid", "xy_sim", "dataclasses"}  # packages whose calls of constructors and methods are not checked
WHOLE = 2**53  # larger whole numbers become real ones
FROM_ARRAYS = "Make a recording of arrays with xy.Recording.from_arrays(sampling_rate, voltage, position)."


class Checked:
    """The arguments of a public call, by the annotations of the function."""

    def __init__(self, function: Callable[..., Any], name: str, skip: int = 0) -> None:
        """name: the public name, for example xy.fit; skip: first arguments that are no part of the call (self)."""
        whole = inspect.signature(function)
        self.name, self.parameters = name, list(whole.parameters.values())[skip:]
        self.signature = whole.replace(parameters=self.parameters)
        self.hints = _hints(function)
        self.usage = _usage(name, self.signature)
        self.usual_range = OWN if function.__name__ == "__init__" else FINITE

    def __call__(self, given: tuple[Any, ...], named: dict[str, Any]) -> inspect.BoundArguments:
        """The converted arguments. Raises BadInput for a wrong type, a number out of range, an unknown name, too many, or too few."""
        given = _in_order(given, [self.hints.get(item.name) for item in self.parameters])
        if not any(item.kind is inspect.Parameter.VAR_KEYWORD for item in self.parameters):
            self._known(named, self.signature.parameters)
        try:
            bound = self.signature.bind(*given, **named)
        except TypeError as problem:
            raise BadInput(f"the call of {self.name}", str(problem), self.usage, "Call it like that.") from None
        for argument, value in bound.arguments.items():
            item, hint = self.signature.parameters[argument], self.hints.get(argument, Any)
            if item.kind is inspect.Parameter.VAR_POSITIONAL:
                bound.arguments[argument] = tuple(self._one(argument, each, hint) for each in value)
            elif item.kind is inspect.Parameter.VAR_KEYWORD:
                bound.arguments[argument] = self._more(value)
            else:
                bound.arguments[argument] = self._one(argument, value, hint, item.default)
        return bound

    def _one(self, argument: str, value: Any, wanted: Any, usual: Any = None) -> Any:
        """One argument, converted and in its range."""
        if wanted is Any:
            return value
        what, act = f"{argument} of {self.name}", f"Call it as {self.usage}."
        for last in (False, True):
            bounds = RANGES.get(argument, self.usual_range)
            wrong = outside(value, bounds, usual, a_path=Path in kinds_of(accepted(wanted)))
            if wrong is not None and (isinstance(wrong[0], str) or is_a(value, wanted)):
                raise BadInput(what, *wrong, act)
            if is_a(value, wanted):
                return float(value) if isinstance(value, int) and abs(value) > WHOLE else value
            if not last:
                value = meant(value, wanted)
        if isinstance(value, str) and is_a([value], wanted):
            act = f'Write {argument}=["{value}"].'
        elif isinstance(value, np.ndarray | list | tuple) and {Run, Recording, FrequencyResponse} & set(kinds_of(wanted)):
            act = f"{act} {FROM_ARRAYS}"
        elif isinstance(usual, tuple) and usual:
            act = f"{act} Usual is {argument}={usual}."
        raise BadInput(what, _quoted(value), in_words(accepted(wanted)), act)

    def _more(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Keywords beyond the parameters: fields of the dataclass that another parameter takes (Reading), or checked by the function."""
        reading = next((kind for kind in kinds_of(self.hints.get("reading")) if dataclasses.is_dataclass(kind)), None)
        if reading is None:
            return dict(given)
        fields, hints = {item.name: item for item in dataclasses.fields(reading)}, _hints(vars(reading)["__init__"])
        self._known(given, fields)
        return {name: self._one(name, value, hints[name], fields[name].default) for name, value in given.items()}

    def _known(self, named: Iterable[str], known: Iterable[str]) -> None:
        """Raises BadInput for an unknown keyword, with the nearest."""
        names = list(known)
        for name in named:
            if name not in names:
                raise unknown_name(name, names, self.name)


def for_people(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    """The function with conversion and check of its arguments (``Checked``), in either order if only one order is possible."""
    checked = Checked(function, name)

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        bound = checked(given, named)
        return function(*bound.args, **bound.kwargs)

    return call


def guard(kind: type, name: str) -> None:
    """Constructor and public methods of a class check their arguments like functions, in calls from outside the package."""
    short = name.rpartition(".")[2]
    for key, value in list(vars(kind).items()):
        function = value.__func__ if isinstance(value, classmethod) else value
        if not inspect.isfunction(function) or (key.startswith("_") and key != "__init__") or hasattr(function, "__wrapped__"):
            continue
        told = name if key == "__init__" else f"{name if function is not value else short}.{key}"
        call = _from_outside(function, told)
        setattr(kind, key, classmethod(call) if function is not value else call)


def _from_outside(function: Callable[..., Any], name: str) -> Callable[..., Any]:
    made: list[Checked] = []  # at the first call from outside

    @functools.wraps(function)
    def call(itself: Any, /, *given: Any, **named: Any) -> Any:
        if sys._getframe(1).f_globals.get("__name__", "").partition(".")[0] in INSIDE:
            return function(itself, *given, **named)
        if not made:
            made.append(Checked(function, name, skip=1))
        bound = made[0](given, named)
        return function(itself, *bound.args, **bound.kwargs)

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

    def missing(name: str) -> Any:
        raise AttributeError(f"module 'xy_sysid.plot' has no attribute {name!r}; it has {', '.join(key for key in vars(shown) if key[0] != '_')}")

    vars(shown)["__getattr__"] = missing
    return shown


def _in_order(given: tuple[Any, ...], wanted: list[Any]) -> tuple[Any, ...]:
    """The first two arguments exchanged, if they fit only so."""
    if len(given) < 2 or len(wanted) < 2 or None in wanted[:2]:
        return given
    first, second = given[:2]
    if is_a(first, wanted[0]) or is_a(second, wanted[1]) or (could_be(first, wanted[0]) and could_be(second, wanted[1])):
        return given
    return (second, first, *given[2:]) if could_be(second, wanted[0]) and could_be(first, wanted[1]) else given


def _quoted(value: Any) -> str:
    """Short values with their type; for others only the type."""
    if value is None:
        return "None"
    words = repr(value) if isinstance(value, str | int | float | bool | list | dict | tuple) else ""
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
