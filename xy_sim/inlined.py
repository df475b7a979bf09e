"""Functions that are compiled together with whatever compiled code calls them.

They keep no cache of their own, so the one cache that counts, the kernel's, can be keyed on the text of them all.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from numba.extending import register_jitable

P = ParamSpec("P")
R = TypeVar("R")


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, callable from Python and from compiled code; inlining by force makes the kernel a quarter faster."""
    compilable: Callable[P, R] = register_jitable(forceinline=True)(function)
    return compilable


def called(function: Callable[P, R]) -> Callable[P, R]:
    """The same, but compiled once and called: for what most machines do not need, so that it makes the kernel no slower."""
    compilable: Callable[P, R] = register_jitable(function)
    return compilable
