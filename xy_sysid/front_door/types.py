"""Whether a value has the annotated type, and the type in words."""

from __future__ import annotations

import collections.abc
import types
from itertools import islice
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

from xy_sysid.linear.any_model import AnyModel

NUMBERS: dict[Any, type] = {int: Integral, float: Real}
TEXT = (str, bytes)


def is_a(value: object, wanted: Any) -> bool:
    """Whether a value has the wanted type, without checking its items; int counts as float, and text does not count as a list of words."""
    kind = get_origin(wanted) or wanted
    if kind in (Union, types.UnionType):
        return any(is_a(value, one) for one in get_args(wanted))
    if kind is Literal:
        return value in get_args(wanted)
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
        return "a dictionary"
    if parts and isinstance(kind, type) and issubclass(kind, collections.abc.Iterable):
        return f"a list of {in_words(parts[0])}"
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _items(value: Any) -> tuple[object, ...]:
    """The first items of what can be gone through more than once; of an array without a dimension the array, which is no list."""
    try:
        again = iter(value)
    except TypeError:
        return (value,)
    return () if again is value else tuple(islice(again, 3))
