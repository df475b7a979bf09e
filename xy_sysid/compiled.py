"""numba's njit with types: compiled to machine code at first use, and kept on disk for the next process."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, compiled; strict IEEE arithmetic, so that results repeat bit for bit on one machine."""
    return cast("Callable[P, R]", numba.njit(cache=True, fastmath=False)(function))
