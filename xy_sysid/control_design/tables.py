"""Tables for a drive: dry friction by speed; force, drag, gain and scale error by position; and the error that remains with each."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.laws import along, asks, driving_factor, friction, of_category
from xy_sysid.control_design.uncertain import derive_row
from xy_sysid.samples.block import FloatArray

ROWS_OF_A_PERIOD = 24  # places of a table in the shortest period that it has to follow
MOST_ROWS = 2000
SPEEDS = 13  # in each direction


@dataclass(frozen=True, slots=True)
class Correction:
    """A correction table by position or speed; ``meaning`` says how to use it.

    name: ``friction``, ``force``, ``drag``, ``gain``, ``scale``, or ``residual`` (measured); at: (n,) positions, m, or speeds, m/s
    value, low, high: (n,) the correction and its 95 % interval; at_unit, unit: of ``at`` and ``value``, SI
    """

    name: str
    at: FloatArray
    value: FloatArray
    low: FloatArray
    high: FloatArray
    at_unit: str
    unit: str
    meaning: str

    @property
    def before(self) -> float:
        """rms error without the table, in ``unit``."""
        return float(np.sqrt(np.mean(self.value**2)))

    @property
    def after(self) -> float:
        """rms error with the table, in ``unit``: one standard error, a quarter of the 95 % interval."""
        return float(np.sqrt(np.mean((0.25 * (self.high - self.low)) ** 2)))

    def csv(self) -> str:
        """The table as CSV, with the units in its header."""
        first = "speed" if self.name == "friction" else "position"
        rows = [f"{first}_{_plain(self.at_unit)},{self.name}_{_plain(self.unit)},low,high"]
        rows += [f"{a:.9g},{b:.7g},{c:.7g},{d:.7g}" for a, b, c, d in zip(self.at, self.value, self.low, self.high, strict=True)]
        return "\n".join(rows) + "\n"


def friction_table(model: PhysicalModel, top: float) -> Correction | None:
    """Dry friction, signed, by speed from -``top`` to ``top``, m/s; None without dry friction."""
    if not any(effect.is_dry for effect, _ in of_category(model.model, "friction", "bristle")):
        return None
    positive = np.concatenate(([0.0], np.geomspace(1e-3 * top, top, SPEEDS)))
    speeds = np.concatenate((-positive[::-1], positive))
    ways = np.concatenate((-np.ones(positive.size), np.ones(positive.size)))

    def of(item: AxisModel) -> FloatArray:
        turn = math.copysign(1.0, item.gain)
        return np.array([turn * way * friction(item, float(v), float(way)) for v, way in zip(speeds, ways, strict=True)]) / driving_factor(item)

    value, low, high = derive_row(model, of)
    meaning = "add to the command while the path moves at this speed; the two rows at 0 are breakaway back and forth"
    units = model.units
    return Correction(name="friction", at=speeds, value=value, low=low, high=high, at_unit=units.speed, unit=units.input, meaning=meaning)


def position_tables(model: PhysicalModel, travel: tuple[float, float]) -> tuple[Correction, ...]:
    """The tables of force, drag, gain and scale error over the travel, m, as far as the model has them."""
    places = _places(model.model, travel)
    laws = [asks(effect) & {"x", "v", "u"} for effect, _ in of_category(model.model, "force")]
    subtracted = "error of the encoder at this position: subtract it from the reading, or add it to the commanded position"
    kinds = (
        ("force", "V", "add to the command at this position", {"x"} in laws),
        ("drag", "V/(m/s)", "add to kV at this position", {"x", "v"} in laws),
        ("gain", "", "divide the command by this at this position", any({"x", "u"} <= law for law in laws)),
        ("scale", "m", subtracted, any(of_category(model.model, "encoder"))),
    )
    found = []
    for name, unit, meaning, is_there in kinds:
        if is_there:
            value, low, high = derive_row(model, _along(places, name))
            shown = model.units.of(unit) if unit else ""
            found.append(Correction(name=name, at=places, value=value, low=low, high=high, at_unit=model.units.output, unit=shown, meaning=meaning))
    return tuple(found)


def _along(places: FloatArray, what: str) -> Callable[[AxisModel], FloatArray]:
    """The row of a table; where it is added to the command, with the friction that grows with the command."""
    return lambda item: along(item, places, what) / (driving_factor(item) if what in ("force", "drag") else 1.0)


def _places(model: AxisModel, travel: tuple[float, float]) -> FloatArray:
    """(n,) positions over the travel, m, with ``ROWS_OF_A_PERIOD`` in the shortest period."""
    periods = [dict(zip(model.library[name].names, values, strict=True)).get("period", math.inf) for name, values in model.effects]
    periods += [2.0 * math.pi for name, _ in model.effects if model.library[name].angular]
    way = travel[1] - travel[0]
    rows = min(max(math.ceil(way / min(periods, default=math.inf) * ROWS_OF_A_PERIOD) + 1, 2 * ROWS_OF_A_PERIOD + 1), MOST_ROWS)
    return np.linspace(travel[0], travel[1], rows)


def _plain(unit: str) -> str:
    """A unit as part of a column's name."""
    return unit.replace("/(", "/").replace(")", "").replace("/", "_per_").replace(" ", "_") or "1"
