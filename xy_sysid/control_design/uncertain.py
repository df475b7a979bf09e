"""Numbers derived from the parameters of a model, with intervals propagated from those of the parameters.

Each parameter is moved to both ends of its 95 % interval, one at a time, and the changes add as independent ones (JCGM 100:2008, sec. 5.1). The
parameters of a fit are correlated: if their errors cancel, as those of gain and pole in kA, the interval is wider than necessary.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.errors import BadInput
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

FACTOR = 2.0  # a number known to worse than this factor is undetermined
WIDEST = math.pi / 3.0  # rad, half of the interval of an angle: 2 sin(e / 2) is 1
WAYPOINTS = 65  # between an angle and the end of its interval: within 200 rad they are less than half a turn apart
SKIPPED = 7  # first points of the sequence, which lie on a line


@dataclass(frozen=True, slots=True)
class Derived:
    """A number with its 95 % interval.

    unit: of the axis; because: (parameter, half-width of the interval due to it), largest first; determined: False if it is known to worse
    than a factor of two (an angle: 60 degrees) or if a parameter that it needs has no interval; meaning: in words
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    meaning: str
    because: tuple[tuple[str, float], ...] = ()
    determined: bool = True

    @property
    def doubt(self) -> str:
        """Why it should not be used; empty if it can be used."""
        if self.determined:
            return ""
        most = self.because[0][0] if self.because else "the parameters, whose intervals are not known"
        return f"{self.name} is not determined by the data: it depends on {most}"


def derive(model: PhysicalModel, name: str, unit: str, meaning: str, of: Callable[[AxisModel], float], angle: bool = False) -> Derived:
    """The number ``of`` the model, with its interval; angle: True for an angle, rad, which is unwrapped over the interval."""
    value, low, high, parts = _moved(model, lambda item: np.array([of(item)]), WAYPOINTS if angle else 2)
    parts.sort(key=lambda item: -item[1])
    first, down, up = float(value[0]), float(value[0] - low[0]), float(value[0] + high[0])
    because = tuple((who, change) for who, change in parts if change > 0.0)
    return Derived(
        name=name,
        value=first,
        low=down,
        high=up,
        unit=model.units.of(unit),
        meaning=meaning,
        because=because,
        determined=bool(model.parameters) and (is_known_angle(down, up) if angle else is_determined(first, down, up)),
    )


def derive_row(model: PhysicalModel, of: Callable[[AxisModel], FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The numbers (n,) ``of`` the model, and both ends of their intervals."""
    value, low, high, _ = _moved(model, of)
    return value, value - low, value + high


def is_determined(value: float, low: float, high: float) -> bool:
    """Whether a number is known to a factor of two, with its sign; an exact 0 always is."""
    if value == 0.0:
        return True
    near, far = sorted((abs(low), abs(high)))
    return math.isfinite(low + high) and low * high > 0.0 and far <= FACTOR * abs(value) and near * FACTOR >= abs(value)


def is_known_angle(low: float, high: float) -> bool:
    """Whether compensation with an angle from this interval, rad, reduces the force: an error e of the angle leaves 2 sin(e / 2) of it."""
    return 0.5 * (high - low) < WIDEST


def undetermined(model: PhysicalModel, names: tuple[str, ...]) -> tuple[str, ...]:
    """Those of the named parameters that the data do not determine, or whose interval is unknown."""
    known = {item.name: item for item in model.parameters}
    return tuple(name for name in names if name not in known or not is_determined(known[name].value, known[name].low, known[name].high))


def with_values(model: AxisModel, values: dict[str, float]) -> AxisModel:
    """The model with some parameters changed, without per-recording values, which belong to the fitted model."""
    effects = tuple(
        (name, tuple(values.get(f"{name}.{key}", value) for key, value in zip(model.library[name].names, row, strict=True)))
        for name, row in model.effects
    )
    base = {name: values.get(name, getattr(model, name)) for name in ("gain", "delay", "pole")}
    return replace(model, **base, effects=effects, per_recording=())


def later(model: PhysicalModel, seconds: float) -> PhysicalModel:
    """The model with this much more delay, also in the interval of the delay: the axis together with the calculation time of a controller."""
    known = tuple(
        replace(item, value=item.value + seconds, low=item.low + seconds, high=item.high + seconds) if item.name == "delay" else item
        for item in model.parameters
    )
    return replace(model, model=replace(model.model, delay=model.model.delay + seconds), fit=None, known=known)


def samples(model: PhysicalModel, count: int) -> tuple[AxisModel, ...]:
    """The model, and ``count`` more whose parameters lie within their 95 % intervals: evenly, by a Halton sequence (Halton 1960).

    Raises BadInput if a parameter of the base has no finite interval: then there is no worst case.
    """
    known = model.parameters
    for item in known:
        if item.name in ("gain", "delay", "pole") and not math.isfinite(item.low + item.high):
            raise BadInput(f"interval of {item.name}", "not finite", "one that the data determine", "Record a longer or livelier motion.")
    if not known:
        return (model.model,)
    points = scipy.stats.qmc.Halton(len(known), scramble=False).random(count + SKIPPED)[SKIPPED:]
    return (model.model, *(with_values(model.model, dict(_drawn(known, row))) for row in points))


def _drawn(known: tuple[Estimate, ...], row: FloatArray) -> Iterator[tuple[str, float]]:
    for item, place in zip(known, row.tolist(), strict=True):
        z = float(np.clip(scipy.special.ndtri(place) / Z95, -1.0, 1.0))
        end = item.high if z > 0.0 else item.low
        if math.isfinite(end):
            yield item.name, item.value + abs(z) * (end - item.value)


def _moved(
    model: PhysicalModel, of: Callable[[AxisModel], FloatArray], steps: int = 2
) -> tuple[FloatArray, FloatArray, FloatArray, list[tuple[str, float]]]:
    """Value, deviations below and above it, and each parameter's part (of the first number); steps: above 2 an angle is unwrapped in these steps."""
    value = np.asarray(of(model.model), dtype=np.float64)
    below, above = np.zeros_like(value), np.zeros_like(value)
    parts: list[tuple[str, float]] = []
    for item in model.parameters:
        own = np.zeros((2, *value.shape))
        for which, end in enumerate((item.low, item.high)):
            if math.isfinite(end):
                way = np.linspace(item.value, max(end, 1e-9) if item.name == "pole" else end, steps)[1:].tolist()
                there = [np.asarray(of(with_values(model.model, {item.name: place}))) for place in way]
                own[which] = (np.unwrap([value, *there], axis=0)[-1] if steps > 2 else there[-1]) - value
            elif not np.array_equal(of(with_values(model.model, {item.name: item.value * 1.01 + 1e-12})), value):
                own[which] = math.inf
        down, up = np.maximum(-own.min(axis=0), 0.0), np.maximum(own.max(axis=0), 0.0)
        below, above = np.hypot(below, down), np.hypot(above, up)
        parts.append((item.name, float(max(down.flat[0], up.flat[0]))))
    return value, below, above, parts
