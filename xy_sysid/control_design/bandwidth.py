"""The limits of the bandwidth: the loss due to each part of the axis, and the gain by a filter in the loop.

A part is removed and the loop is designed again: the new crossover shows the loss due to that part. A notch and a low-pass are
judged in the same way: a filter is used if the loop reaches a higher crossover with it, for every sample of the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis.linear_part import lag_of
from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import NO_LIMIT, Encoder
from xy_sysid.control_design.feedback import USUAL, Asked, Feedback, feedback
from xy_sysid.control_design.filters import HIGHEST, LoopFilter, Swing, low_pass, notch
from xy_sysid.control_design.sampled import sampled
from xy_sysid.control_design.uncertain import later
from xy_sysid.errors import BadInput

PASSED = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4)  # of a resonance's frequency: cut-offs to test for a low-pass
UNCERTAIN, HOLD, CALCULATION = "uncertainty of the parameters", "sampling and hold", "calculation"


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of a part of the axis. phase: phase lag at the crossover, degrees; without: Hz, crossover of a loop without it (NaN: none)."""

    part: str
    phase: float
    without: float


@dataclass(frozen=True, slots=True)
class Bandwidth:
    """crossover: Hz, the highest that keeps the margins; costs: of each part, the largest first."""

    crossover: float
    costs: tuple[Cost, ...]


def bandwidth_of(model: PhysicalModel, sampling_rate: float, at: float, asked: Asked = USUAL, calculation: float = 0.0) -> Bandwidth:
    """The highest crossover that keeps the margins, and the cost of each part.

    at: Hz, the crossover at which phases are counted; calculation: s, delay of the controller, which is added to that of the model

    Raises BadInput where no crossover has the margins.
    """
    asked = replace(asked, bandwidth=None)
    alone, model = model, later(model, calculation)
    best = feedback(model, sampling_rate, asked).nominal.crossover
    own = model.model
    parts: list[tuple[str, AxisModel]] = []
    if alone.model.delay > 0.0:
        parts.append(("delay", replace(own, delay=calculation)))
    for name, values in own.effects:
        effect = own.library[name]
        if effect.category == "motion" or lag_of(effect, values) is not None or "share" in effect.names:
            parts.append((name, replace(own, effects=tuple(item for item in own.effects if item[0] != name), per_recording=())))
    whole = _phase(own, sampling_rate, at)
    found = [Cost(HOLD, 180.0 * at / sampling_rate, math.nan)]
    for name, left in parts:
        kept = tuple(item for item in model.parameters if item.name in left.values() and item.name != name)
        bare = replace(model, model=left, fit=None, known=kept)
        found.append(Cost(name, _less(_phase(left, sampling_rate, at), whole), _reached(bare, sampling_rate, asked)))
    if calculation > 0.0:
        phase = _less(_phase(alone.model, sampling_rate, at), whole)
        found.append(Cost(CALCULATION, phase, _reached(alone, sampling_rate, asked)))
    if model.parameters:
        sure = replace(model, fit=None, known=())
        found.append(Cost(UNCERTAIN, 0.0, _reached(sure, sampling_rate, asked)))
    found.sort(key=lambda item: (-item.without if math.isfinite(item.without) else 0.0, -item.phase))
    return Bandwidth(crossover=best, costs=tuple(found))


def with_filter(
    model: PhysicalModel, sampling_rate: float, modes: Sequence[Swing], without: Feedback, encoder: Encoder | None = None, limit: float = NO_LIMIT
) -> tuple[LoopFilter, Feedback] | None:
    """The notch or low-pass with the highest crossover, and its loop; None if none exceeds that of ``without``."""
    best: tuple[LoopFilter, Feedback] | None = None
    for mode in modes:
        highest = HIGHEST * sampling_rate
        notches = [notch(mode, sampling_rate)] if mode.free.value < highest else []
        for tried in (*notches, *(low_pass(min(part * mode.free.value, highest), sampling_rate) for part in PASSED)):
            try:
                loop = feedback(model, sampling_rate, without.asked, tried.section[None, :], encoder, limit)
            except BadInput:
                continue
            if loop.crossover > (best[1] if best is not None else without).crossover:
                best = (tried, loop)
    return best


def _reached(model: PhysicalModel, sampling_rate: float, asked: Asked) -> float:
    """Hz, the crossover of a loop; NaN if none has the margins."""
    try:
        return feedback(model, sampling_rate, asked).nominal.crossover
    except BadInput:
        return math.nan


def _phase(model: AxisModel, sampling_rate: float, at: float) -> float:
    """Degrees of the sampled axis at a frequency, Hz."""
    return float(np.angle(sampled(model, sampling_rate).response(np.array([at]))[0], deg=True))


def _less(one: float, other: float) -> float:
    """The difference of two angles, degrees, within half a turn."""
    return (one - other + 180.0) % 360.0 - 180.0
