"""The limits of the machine in an experiment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xy_sysid.axis.forward import Motion
from xy_sysid.errors import BadInput
from xy_sysid.excitation.motion_check import most_centring
from xy_sysid.experiment_design.criteria import MARGIN, POINTS_EACH
from xy_sysid.experiment_design.experiment import RAMP
from xy_sysid.samples.recording import Run
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import USUAL, Units, readable

SECONDS = 60.0  # s of motion for one experiment at most


@dataclass(frozen=True, slots=True)
class MachineLimits:
    """The limits of one axis.

    voltage: V, of each sample; rms: V, that the drive can give continuously (its current); speed: m/s; acceleration: m/s^2
    travel: (low, high) m; start: m, position at the start of an experiment; with recordings, the end of the last one
    margin: fraction of speed, acceleration and travel that is kept free; seconds: maximum s of one experiment
    centring: V/m, largest centring gain of the excitation; above it the axis would oscillate
    ramp: s, fade-in of the excitation; brake: m, brake zone before each end of the travel, which no experiment enters
    reach: m, largest distance from the start; highest: Hz, highest frequency of the drive signal that the machine can follow
    units: of the axis; in other units, read V and m above as these
    """

    voltage: float
    travel: tuple[float, float]
    start: float = 0.0
    rms: float = math.inf
    speed: float = math.inf
    acceleration: float = math.inf
    margin: float = MARGIN
    seconds: float = SECONDS
    centring: float = math.inf
    ramp: float = RAMP
    brake: float = 0.0
    reach: float = math.inf
    highest: float = math.inf
    units: Units = USUAL

    def __post_init__(self) -> None:
        for name in ("voltage", "rms", "speed", "acceleration", "seconds", "centring", "reach", "highest"):
            if not getattr(self, name) > 0.0:
                raise BadInput(f"limit of {name}", getattr(self, name), "above 0", "Give the limits of the machine.")
        most, farthest = (most_of(name) for name in ("limit", "travel_max"))
        if self.voltage > most:
            unit = self.units.input
            raise BadInput("limit of voltage", f"{self.voltage:.4g} {unit}", f"up to {most:g} {unit}", "Give less, or the input in a larger unit.")
        if max(map(abs, self.travel)) > farthest:
            allowed = f"within {self.span((-farthest, farthest))}"
            raise BadInput("travel", self.span(self.travel), allowed, "Give ends that lie nearer, or positions in a larger unit.")
        if not 0.0 <= self.margin < 1.0:
            raise BadInput("margin", self.margin, "0 to below 1", "Give the part of each limit that is kept free.")
        if not self.travel[0] + self.brake < self.start < self.travel[1] - self.brake:
            zones = f" without brake zones of {self.place(self.brake)}" if self.brake else ""
            allowed = f"where the axis stands, {self.place(self.start)}, between its ends{zones}"
            raise BadInput("travel", self.span(self.travel), allowed, "Give the ends of the travel, or move the axis between them.")

    def place(self, where: float) -> str:
        """A position in display units: 110.7 mm, 1.2 rad."""
        scale, unit = readable(self.units.output)
        return f"{scale * where:.4g} {unit}"

    def span(self, travel: tuple[float, float], to: str = " to ") -> str:
        """Two positions in display units."""
        scale, _ = readable(self.units.output)
        return f"{scale * travel[0]:.4g}{to}{self.place(travel[1])}"

    @property
    def room(self) -> float:
        """m from the start to the nearer end, with the margin."""
        return min(map(self._free, (self.start - self.travel[0], self.travel[1] - self.start)))

    def _free(self, way: float) -> float:
        """Part of the distance to an end, m, that a motion may use: up to the margin, outside the brake zone."""
        return min((1.0 - self.margin) * min(way, self.reach), way - self.brake)

    def needed(self, low: float, high: float) -> tuple[float, float]:
        """The travel needed by a motion between two positions, including the margin."""
        free = 1.0 - self.margin
        return max(self.start + (low - self.start) / free, self.travel[0]), min(self.start + (high - self.start) / free, self.travel[1])

    def broken(self, motion: Motion) -> str:
        """The name of a limit that a motion would exceed, including the margin, or empty."""
        if not np.all(np.isfinite(motion.position)):
            return "a model whose simulation diverges"
        speed, acceleration = fastest(motion)
        free = 1.0 - self.margin
        away = motion.position - self.start
        checks = (
            ("voltage", _peak(motion.voltage), self.voltage * (1.0 + 1e-9)),
            ("rms", float(np.sqrt(np.mean(motion.voltage**2))), self.rms),
            ("speed", speed, free * self.speed),
            ("acceleration", acceleration, free * self.acceleration),
            ("travel", float(np.max(away)), self._free(self.travel[1] - self.start)),
            ("travel", -float(np.min(away)), self._free(self.start - self.travel[0])),
        )
        return next((name for name, value, most in checks if value > most), "")


def fastest(motion: Motion) -> tuple[float, float]:
    """The largest speed and acceleration of a motion, m/s and m/s^2."""
    speed = np.diff(motion.position) * motion.sampling_rate
    count = max(round(1e-3 * motion.sampling_rate), 1)  # averaged over a millisecond
    return _peak(speed), _peak(np.diff(speed[::count]) * motion.sampling_rate / count)


def of_settings(settings: ExcitationSettings, axis: str) -> dict[str, Any]:
    """The limits of an axis, by name, from the settings of its excitation. For positions, ``limit`` is the reach, and the effort is not limited."""
    own = settings.axes[axis]
    found: dict[str, Any] = {
        "travel": (own.travel_min, own.travel_max),
        "speed": own.max_speed or math.inf,
        "acceleration": own.max_acceleration or math.inf,
        "ramp": settings.ramp,
        "brake": own.brake,
    }
    if settings.holds:
        return {**found, "reach": own.limit, "highest": settings.rate / POINTS_EACH}
    return {**found, "voltage": own.limit, "centring": float(most_centring(settings)[list(settings.axes).index(axis)])}


def as_recorded(runs: Sequence[Run], **told: Any) -> MachineLimits:
    """Limits from recordings: the largest voltage of all, and the travel of the last one, starting at its end.

    Another recording may have another zero, so its positions do not apply to the last one. told: known limits
    Raises BadInput if the last recording does not move, or ends at its furthest position.
    """
    voltage, last = max(_peak(run.voltage) for run in runs), runs[-1]
    travel = float(np.min(last.position)), float(np.max(last.position))
    if not (("voltage" in told or voltage > 0.0) and ("travel" in told or travel[1] > travel[0])):
        raise BadInput("recordings", "without voltage or motion", "an axis that moves", "Give the limits: voltage and travel.")
    return MachineLimits(**{"voltage": voltage, "travel": travel, "start": float(last.position[-1]), "units": last.units, **told})


def _peak(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def most_of(name: str) -> float:
    """The largest value that the excitation accepts for a setting of an axis."""
    return float(next(bound.le for bound in AxisExcitation.model_fields[name].metadata if hasattr(bound, "le")))
