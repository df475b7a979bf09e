"""Models with known numbers and intervals, like those of a fit."""

from __future__ import annotations

from dataclasses import replace

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.response.estimate import Estimate
from xy_sysid.units import USUAL, Units

RATE = 2000.0  # Hz, of their assumed recording
GAIN, DELAY, POLE = 0.097, 1.63e-3, 236.0  # m/s/V, s, rad/s: the table of the paper


def axis(*effects: str, delay: float = DELAY) -> AxisModel:
    """The rigid table with effects of their typical sizes."""
    model = AxisModel(GAIN, delay, POLE)
    for name in effects:
        model = model.with_effect(name)
    return model


def known(*effects: str, spread: float = 0.02, units: Units = USUAL, **wider: float) -> PhysicalModel:
    """The same with intervals of this fraction of each number on both sides; wider: ``effect__parameter`` with another fraction."""
    model = axis(*effects)
    parts = {name.replace("__", "."): part for name, part in wider.items()}
    items = []
    for name, value in model.values().items():
        half = abs(value) * parts.get(name, spread)
        items.append(Estimate(name=name, value=value, unit=_unit(model, name), low=value - half, high=value + half))
    return PhysicalModel(model, "x", units=units, known=tuple(items), sampling_rate=RATE)


def _unit(model: AxisModel, name: str) -> str:
    base = {"gain": "m/s/V", "delay": "s", "pole": "rad/s"}
    if name in base:
        return base[name]
    effect, key = name.split(".")
    return next(item.unit for item in model.library[effect].parameters if item.name == key)


def unknown(*effects: str) -> PhysicalModel:
    """The same without intervals."""
    return replace(known(*effects), known=())
