"""Why a fit does not count, whatever its error: a size at its bound, a travel that is too short, a mode outside the excited band."""

from __future__ import annotations

import math
from collections.abc import Sequence

from xy_sysid.axis.linear_part import resonance
from xy_sysid.axis.model import Library
from xy_sysid.effects import Effect, Parameter
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import AT_BOUND, BEYOND, FEWEST, HIGHEST_MODE


def refusal(data: AxisData, library: Library, found: GreyboxFit, given: frozenset[str] = frozenset()) -> str:
    """Why a fit does not count, whatever its error: in words, or empty. given: effects that a user asked for, which are not checked."""
    low, high = data.sampling_rate * 0.0, HIGHEST_MODE * data.sampling_rate
    excited = data.layout.edges()[:-1][data.floor.excited]
    if excited.size:
        low, high = float(excited[0]), min(high, BEYOND * float(data.layout.edges()[1:][data.floor.excited][-1]))
    for name, values in found.model.effects:
        if name in given:
            continue
        effect = library[name]
        why = effect.refusal(values, data.reach) if effect.refusal is not None else ""
        if why:
            return f"{name}: {why}"
        if data.passed_once and effect.is_by_place and not _repeats(data, effect, values):
            return f"{name}: each position is passed only once, so an effect of position cannot be distinguished from a drift"
        for k, (item, value) in enumerate(zip(effect.on(data.similar), values, strict=True)):
            if k == 0 and at_bound(item, value):
                return f"{name}: {item.name} is at its bound"
            if k == 0 and _is_none(data, effect, found):
                return f"{name}: {item.name} cannot be distinguished from 0"
            if item.name == effect.mode_frequency:
                outside = [hertz for hertz in (value, resonance(effect, values)) if not low <= hertz <= high]
                if outside:
                    return f"{name}: a mode at {outside[0]:.3g} Hz, outside the excited band ({low:.3g} to {high:.3g} Hz)"
    if found.model.delay >= AT_BOUND * data.longest_delay:
        return f"time_delay: {found.model.delay:.3g} s is at its bound"
    return ""


def at_bound(item: Parameter, value: float) -> bool:
    """A size is the largest that is looked for, of a size with a sign on either side."""
    ends = (item.high,) if item.positive else (item.low, item.high)
    return any(end != 0.0 and abs(value - end) <= 1e-6 * abs(end) for end in ends)


def none_of(data: AxisData, found: GreyboxFit) -> str:
    """The effect of a fit whose interval contains its least size, so the data do not distinguish it from none. Empty if there is no such effect."""
    library = found.model.library
    return next((name for name, _ in found.model.effects if _is_none(data, library[name], found)), "")


def _is_none(data: AxisData, effect: Effect, found: GreyboxFit) -> bool:
    size = effect.on(data.similar)[0]
    known = found.parameter(f"{effect.name}.{size.name}")
    return size.positive and not found.is_screening and math.isfinite(known.high) and known.low <= size.low * (1.0 + 1e-6)


def _repeats(data: AxisData, effect: Effect, values: Sequence[float]) -> bool:
    """A law of position that repeats often enough over the travel to be identified from one pass."""
    period = values[effect.names.index("period")] if "period" in effect.names else 2.0 * math.pi
    return effect.repeats and (data.reach[1] - data.reach[0]) / period >= FEWEST
