"""From the text of the loop to machine code, cached on disk for other processes (see ``jit``)."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from xy_sysid.axis import interpolation, resonant_loop
from xy_sysid.axis.loop_source import moving, text, undoable, undoing
from xy_sysid.effects import _pole_zero_pair
from xy_sysid.effects._binding import law_names, law_texts
from xy_sysid.effects._contract import Effect
from xy_sysid.jit import compiled_text
from xy_sysid.samples.block import FloatArray

Undoing = Callable[[FloatArray, FloatArray, FloatArray, NDArray[np.uint8], float, FloatArray, FloatArray, FloatArray], float]
Moving = Callable[..., None]
Kernel = Callable[[FloatArray, FloatArray, FloatArray, NDArray[np.uint8], float, float, float, FloatArray], None]


def build(effects: Sequence[Effect]) -> Kernel:
    """The compiled loop of these effects; it is compiled at its first call, or loaded from disk."""
    return cast("Kernel", _compiled(text, effects))


def build_moving(effects: Sequence[Effect]) -> Moving:
    """The compiled loop of an axis whose position follows from its simulated motion; see ``loop_source.moving``."""
    return cast("Moving", _compiled(moving, effects))


def build_undoing(effects: Sequence[Effect]) -> Undoing:
    """The compiled loop that removes these effects from a recording."""
    return cast("Undoing", _compiled(undoing, [effect for effect in effects if undoable(effect)]))


def _compiled(source: Callable[[str, Sequence[Effect]], str], effects: Sequence[Effect]) -> Callable[..., Any]:
    names = {"math": math, "np": np, **resonant_loop.LOOP, "along": interpolation.along, "pieces": interpolation.pieces, **law_names(effects)}
    parts = [*law_texts(effects), *(inspect.getsource(module) for module in (_pole_zero_pair, resonant_loop, interpolation))]
    return compiled_text(lambda name: source(name, effects), names, parts)
