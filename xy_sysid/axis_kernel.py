"""From the text of the loop to machine code, kept on disk for the next process.

The text becomes a function through Python's own import machinery; numba keeps its code beside this file's (or in the
user's cache folder), under a name that carries the check sum of every law, so that a changed law is never run stale.
"""

from __future__ import annotations

import hashlib
import importlib.abc
import importlib.util
import inspect
import math
from collections.abc import Callable, Sequence
from types import CodeType, ModuleType
from typing import Any, cast

import numba
import numpy as np
from numpy.typing import NDArray

from xy_sysid import between, swing
from xy_sysid.compiled import compiled
from xy_sysid.effect_code import called, text, undoable, undoing
from xy_sysid.effects import modes
from xy_sysid.effects.contract import Effect
from xy_sysid.stream import FloatArray

Undoing = Callable[[FloatArray, FloatArray, FloatArray, NDArray[np.uint8], float, FloatArray, FloatArray, FloatArray], float]
Kernel = Callable[[FloatArray, FloatArray, FloatArray, NDArray[np.uint8], float, float, FloatArray], None]


class _Text(importlib.abc.InspectLoader):
    """A module whose source is a text in memory and whose names are given."""

    def __init__(self, source: str, names: dict[str, object]) -> None:
        self.source, self.names = source, names

    def get_source(self, fullname: str) -> str:
        return self.source

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self.source, __file__)  # numba's cache asks for a file that is there

    def exec_module(self, module: ModuleType) -> None:
        module.__dict__.update(self.names)
        super().exec_module(module)


def fingerprint(source: str, effects: Sequence[Effect]) -> str:
    """Check sum of a loop and of every module that has a part in it."""
    functions = [item for effect in effects for item in effect.functions.values()]
    parts = {inspect.getsource(inspect.getmodule(item) or item) for item in functions} | {
        inspect.getsource(modes),
        inspect.getsource(swing),
        inspect.getsource(between),
    }
    total = hashlib.sha256(source.encode())
    for part in sorted(parts):
        total.update(part.encode())
    return total.hexdigest()[:16]


def build(effects: Sequence[Effect]) -> Kernel:
    """The compiled loop of these effects; compiling happens at its first call, or never if the disk has it."""
    return cast("Kernel", _compiled(text, effects))


def build_undoing(effects: Sequence[Effect]) -> Undoing:
    """The compiled loop that takes these effects out of a recording."""
    return cast("Undoing", _compiled(undoing, [effect for effect in effects if undoable(effect)]))


def _compiled(source: Callable[[str, Sequence[Effect]], str], effects: Sequence[Effect]) -> Callable[..., Any]:
    name = f"run_{fingerprint(source('loop', effects), effects)}"
    laws: dict[str, object] = {called(effect, function): item for effect in effects for function, item in effect.functions.items()}
    loader = _Text(
        source(name, effects), {"math": math, "np": np, "__name__": __name__, **swing.LOOP, "along": between.along, **laws}
    )  # numba's cache comes back by this name
    spec = importlib.util.spec_from_loader(f"{__name__}_{name}", loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    function: Callable[..., Any] = module.__dict__[name]
    try:
        return compiled(function)
    except RuntimeError:  # no folder that numba may write to: compile for this process only
        return cast("Callable[..., Any]", numba.njit(function))
