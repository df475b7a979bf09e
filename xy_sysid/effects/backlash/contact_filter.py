"""The compiled filter across a gap for each set of laws of dry friction, made at its first use."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from functools import lru_cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from xy_sysid.effects._binding import law_names, law_texts
from xy_sysid.effects._contract import Effect, law
from xy_sysid.effects.backlash import filter_parts
from xy_sysid.effects.backlash.filter_source import text
from xy_sysid.jit import compiled_text
from xy_sysid.samples.block import FloatArray

Places = NDArray[np.int64]
Filter = Callable[
    [
        FloatArray,
        FloatArray,
        FloatArray,
        FloatArray,
        float,
        float,
        float,
        int,
        FloatArray,
        FloatArray,
        FloatArray,
        Places,
        FloatArray,
        FloatArray,
        FloatArray,
    ],
    None,
]


@lru_cache(maxsize=32)
def _made(laws: tuple[_Laws, ...]) -> Filter:
    effects = [item.effect for item in laws]
    made = (filter_parts.contact, filter_parts.smooth_sign, filter_parts.drifted, filter_parts.kicked)
    names = {"math": math, "np": np, "law": law, **{part.__name__: part for part in made}, **law_names(effects)}
    parts = [*law_texts(effects), inspect.getsource(filter_parts)]
    return cast("Filter", compiled_text(lambda name: text(name, effects), names, parts, exact=False))


class _Laws:
    """Effect as a cache key, compared by identity."""

    def __init__(self, effect: Effect) -> None:
        self.effect = effect

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Laws) and other.effect is self.effect

    def __hash__(self) -> int:
        return id(self.effect)


def filter_with(laws: tuple[Effect, ...]) -> Filter:
    """See ``filter_source.text``. Raises BadInput for laws that cannot act together."""
    return _made(tuple(_Laws(effect) for effect in laws))
