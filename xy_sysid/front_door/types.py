"""Whether a value has the annotated type, and the type in words."""

from __future__ import annotations

import collections.abc
import types
from itertools import islice
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

from xy_sysid.linear.any_model import AnyModel

NUMBERS: dict[Any, type] = {int: Integral, float: Real}
TEXT = (str, bytes)
MOST = 1000  # items of a list that are looked at


def is_a(value: object, wanted: Any) -> bool:
    """Whether a value has the wanted type, and its items theirs; int counts as float, and text does not count as a list of words."""
    kind = get_origin(wanted) or wanted
    if kind in (Union, types.UnionType):
        return any(is_a(value, one) for one in get_args(wanted))
    if kind is Literal:
        return isinstance(value, str) and value in get_args(wanted)
    if wanted is None or kind is type(None):
        return value is None
    if kind is Any:
        return True
    if kind is AnyModel:  # a protocol: what has its parts is one
        return hasattr(type(value), "tf") and hasattr(type(value), "velocity")
    if kind in NUMBERS:
        return isinstance(value, NUMBERS[kind]) and not isinstance(value, bool)
    if kind is collections.abc.Callable:
        return callable(value)
    if not isinstance(kind, type):
        return True  # it cannot be asked
    if kind is np.ndarray:
        return isinstance(value, np.ndarray) and value.ndim > 0 and all(value.dtype.kind in _dtypes(one) for one in get_args(wanted)[1:])
    if kind is tuple and get_args(wanted):
        return isinstance(value, tuple) and _items_fit(value, get_args(wanted))
    if issubclass(kind, collections.abc.Mapping):
        return isinstance(value, kind) and all(is_a(one, each) for pair in value.items() for one, each in zip(pair, get_args(wanted), strict=False))
    if issubclass(kind, collections.abc.Iterable) and issubclass(collections.abc.Sequence, kind):
        a_list = isinstance(value, kind) and not isinstance(value, TEXT)
        return a_list and all(is_a(item, one) for one in get_args(wanted)[:1] for item in _items(value))
    return isinstance(value, kind)


def in_words(wanted: Any) -> str:
    """The type in words."""
    kind, parts = get_origin(wanted) or wanted, get_args(wanted)
    if kind in (Union, types.UnionType):
        words = list(dict.fromkeys(in_words(one) for one in parts if one is not str or Path not in parts))
        return " or ".join((", ".join(words[:-1]), words[-1])) if len(words) > 1 else words[0]
    if kind is Literal:
        return " or ".join(map(repr, parts))
    if wanted is None or kind is type(None):
        return "None"
    plain = {int: "a whole number", float: "a number", str: "text", bool: "True or False", AnyModel: "a model"}
    if kind in plain:
        return plain[kind]
    if kind is collections.abc.Callable:
        return "a function"
    if kind is Path:
        return "a path"
    name = getattr(kind, "__name__", str(kind))
    if isinstance(kind, type) and issubclass(kind, collections.abc.Mapping):
        return f"a dictionary {{{': '.join(map(in_words, parts))}}}"
    if kind is np.ndarray:
        return "an array of True and False" if "b" in _dtypes(parts[1]) else "an array of numbers"
    if kind is tuple and parts and parts[1:] != (...,):
        return f"{len(parts)} values ({', '.join(map(in_words, parts))})"
    if parts and isinstance(kind, type) and issubclass(kind, collections.abc.Iterable):
        return f"a list of {in_words(parts[0])}"
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _items_fit(value: tuple[object, ...], parts: tuple[Any, ...]) -> bool:
    if parts[1:] == (...,):
        return all(is_a(item, parts[0]) for item in value)
    return len(value) == len(parts) and all(map(is_a, value, parts))


def _dtypes(wanted: Any) -> str:
    """The kinds of numbers that an array of this type may hold."""
    return {"f": "fiu", "c": "cfiu", "b": "b", "i": "iu"}.get(np.dtype(get_args(wanted)[0]).kind, "")


def _items(value: Any) -> tuple[object, ...]:
    """The first items of what can be gone through more than once; of an array without a dimension the array, which is no list."""
    try:
        again = iter(value)
    except TypeError:
        return (value,)
    return () if again is value else tuple(islice(again, MOST))
