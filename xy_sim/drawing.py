"""Parts and their sizes, drawn from a seed onto the axes of a machine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from xy_sim.machine_file import Axis, Spec
from xy_sim.parts import PARTS
from xy_sim.parts.contract import Parameter, Part
from xy_sysid.errors import BadInput

Effects = int | str | tuple[int, int]
_STREAM = 20_260  # separates these random numbers from the encoder's, which use the same seed


def drawn(spec: Spec, seed: int | None) -> Spec:
    """The spec with parts drawn as the file's ``hidden`` group says, by default from its seed."""
    group = dict(spec.hidden or {})
    chosen = int(group.get("seed", 1)) if seed is None else seed
    return with_drawn(spec, chosen, group.get("effects", "1..2"), float(group.get("scale", 1.0)))


def with_drawn(spec: Spec, seed: int, effects: Effects, scale: float) -> Spec:
    """The spec with drawn parts on every axis; each axis has its own random numbers."""
    fewest, most, group = _asked(effects)
    axes = []
    for number, axis in enumerate(spec.axes):
        random = np.random.default_rng([seed, _STREAM, number])
        parts = _choose(axis, group, int(random.integers(fewest, most + 1)), random)
        axes.append(replace(axis, parts=dict(axis.parts) | {part.name: sizes(part, random, scale) for part in parts}))
    return replace(spec, axes=tuple(axes))


def sizes(part: Part, random: np.random.Generator, scale: float = 1.0) -> dict[str, float]:
    """Every parameter of a part, drawn from its range and multiplied by scale^``power``; scale: relative size of the effect."""
    powers = [(1.0 if place == 0 else 0.0) if item.power is None else item.power for place, item in enumerate(part.parameters)]
    return {item.name: _size(item, random, scale**power) for item, power in zip(part.parameters, powers, strict=True)}


def _size(parameter: Parameter, random: np.random.Generator, scale: float) -> float:
    low, high = parameter.low, parameter.high
    fraction, sign = random.random(), -1.0 if random.random() < 0.5 and parameter.signed else 1.0
    value = math.exp(math.log(low) + fraction * math.log(high / low)) if low > 0.0 else low + fraction * (high - low)
    value = float(round(value)) if parameter.whole else value * scale
    return min(max(sign * value, parameter.minimum), parameter.maximum)


def _asked(effects: Effects) -> tuple[int, int, str]:
    """Smallest and largest number of parts, and the group to draw from."""
    if effects == "none":
        return 0, 0, "effect"
    if effects == "outside":
        return 1, 1, "outside"
    texts = [str(item) for item in effects] if isinstance(effects, (tuple, list)) else str(effects).split("..")
    if not all(text.strip().isdigit() for text in texts) or len(texts) > 2 or int(texts[0]) > int(texts[-1]) or int(texts[-1]) > 6:
        raise BadInput("effects", repr(effects), "0 to 6, a range such as 1..3, none, or outside", "Give one of these.")
    return int(texts[0]), int(texts[-1]), "effect"


def _choose(axis: Axis, group: str, count: int, random: np.random.Generator) -> list[Part]:
    """Up to ``count`` parts of the group that the axis does not have, at most one per family."""
    chosen: list[Part] = []
    taken = {PARTS[name].family for name in axis.parts}
    for name in random.permutation(sorted(name for name, part in PARTS.items() if part.drawn)):
        part = PARTS[str(name)]
        free = part.name not in axis.parts and (not part.family or part.family not in taken)
        if len(chosen) < count and part.group == group and free:
            chosen.append(part)
            taken.add(part.family)
    return chosen
