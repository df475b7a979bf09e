"""Functions that are compiled together with the compiled code that calls them.

They have no cache of their own, so the kernel's cache can be keyed on the text of all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from numba.extending import register_jitable

P = ParamSpec("P")
R = TypeVar("R")


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, callable from Python and from compiled code; forced inlining makes the kernel a quarter faster."""
    compilable: Callable[P, R] = register_jitable(forceinline=True)(function)
    return compilable
