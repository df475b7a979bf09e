"""The fastest motion between two positions within the limit of the drive, from the complete feedforward along the path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.laws import driving_factor, force, friction
from xy_sysid.control_design.path import Bounds, SampledPath, s_curve
from xy_sysid.control_design.sample_step import sections
from xy_sysid.errors import BadInput

RESERVE = 0.2  # of the limit, reserved for the feedback
SHARES = np.linspace(0.15, 0.85, 8)  # shares of the voltage for speed to test; the rest is for acceleration
ROUNDS, LOWEST = 10, 0.01  # bisections, to 1e-3; lowest scale of the rigid axis' bounds
PLACES = 101  # positions between two ends at which forces are evaluated
JERK_TIME = 0.02  # least s for building up an acceleration, if there is no resonance


@dataclass(frozen=True, slots=True)
class Fastest:
    """bounds: of the fastest S-curve; path: of the move; voltage: largest of the feedforward, V."""

    bounds: Bounds
    path: SampledPath
    voltage: float


def fastest(models: Sequence[AxisModel], places: Sequence[float], limit: float, sampling_rate: float) -> Fastest:
    """The S-curve through the places that takes least time while the voltage of every model stays below (1 - ``RESERVE``) limit.

    models: samples of the parameters; places: m; limit: V. Raises BadInput if even the slowest motion needs more voltage.
    """
    if not 0.0 < limit < math.inf:
        raise BadInput("limit", f"{limit} V", "above 0 and finite", "Give the drive's largest voltage with limit=.")
    usable = (1.0 - RESERVE) * limit
    centre = models[0]
    held = max(_at_rest(model, min(places), max(places)) for model in models)
    if held >= usable:
        raise BadInput(
            "limit", f"{limit:g} V", f"more than {held / (1.0 - RESERVE):.3g} V, which friction and load need", "Check the limit, or the model."
        )
    best: tuple[float, Bounds, SampledPath, float] | None = None
    rise = max(JERK_TIME, _ringing(centre, sampling_rate), 4.0 * centre.delay)
    for share in SHARES.tolist():
        speed, acceleration = share * usable * abs(centre.gain), (1.0 - share) * usable * abs(centre.gain) * centre.pole

        def at(scale: float, speed: float = speed, acceleration: float = acceleration) -> tuple[Bounds, SampledPath, float]:
            bounds = Bounds(scale * speed, scale * acceleration, scale * acceleration / rise)
            path = s_curve(places, bounds, sampling_rate)
            return bounds, path, max(float(np.max(np.abs(feedforward(model, path).voltage))) for model in models)

        low, high = LOWEST, 1.0
        found = at(1.0)
        if found[2] > usable:
            for _ in range(ROUNDS):
                middle = 0.5 * (low + high)
                tried = at(middle)
                if tried[2] <= usable:
                    low, found = middle, tried
                else:
                    high = middle
        if found[2] <= usable and (best is None or found[1].seconds < best[0]):
            best = (found[1].seconds, *found)
    if best is None:
        raise BadInput("limit", f"{limit:g} V", "enough for a hundredth of the rigid axis' speed", "Check the limit, or the model.")
    return Fastest(bounds=best[1], path=best[2], voltage=best[3])


def _at_rest(model: AxisModel, low: float, high: float) -> float:
    """The largest voltage needed for a start from rest between two positions, V."""
    rubs = max(friction(model, 0.0, 1.0), friction(model, 0.0, -1.0))
    return (rubs + max(abs(force(model, 0.0, float(x))) for x in np.linspace(low, high, PLACES))) / driving_factor(model)


def _ringing(model: AxisModel, sampling_rate: float) -> float:
    """Period of the slowest mode of the attached masses, s, 0 without one: an acceleration built up within one period excites it least."""
    top, _ = sections(model, sampling_rate)
    if top.size == 1:
        return 0.0
    roots = np.roots(top[::-1]) * sampling_rate
    return float(2.0 * math.pi / np.min(np.abs(roots)))
