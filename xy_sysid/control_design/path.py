"""Paths: position, speed and acceleration at each sample, jerk-limited between positions, or the motion of a recording below a frequency."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

ORDER = 4  # of the low-pass, applied forward and backward
SETTLE = 0.2  # s at rest between two moves


@dataclass(frozen=True, slots=True)
class Bounds:
    """The largest speed (m/s), acceleration (m/s2) and jerk (m/s3) of a path."""

    speed: float
    acceleration: float
    jerk: float

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "jerk"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise BadInput(name, value, "above 0 and finite", "Give another value.")


@dataclass(frozen=True, slots=True)
class Moves:
    """Moves between positions: places: m; bounds: of each move; sampling_rate: Hz."""

    places: Sequence[float]
    bounds: Bounds
    sampling_rate: float

    def sampled(self, scale: float = 1.0) -> SampledPath:
        """The path at the sampling rate, ``scale`` times as fast; see ``s_curve``."""
        own = self.bounds
        return s_curve(self.places, Bounds(scale * own.speed, scale**2 * own.acceleration, scale**3 * own.jerk), self.sampling_rate)


@dataclass(frozen=True, slots=True)
class SampledPath:
    """sampling_rate: Hz; position, speed, acceleration: (n,) at each sample, m, m/s, m/s2."""

    sampling_rate: float
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.position.size / self.sampling_rate

    def part(self, start: int, end: int) -> SampledPath:
        """The samples from ``start`` to before ``end``."""
        return SampledPath(self.sampling_rate, self.position[start:end], self.speed[start:end], self.acceleration[start:end])

    def ahead(self, seconds: float) -> SampledPath:
        """The path advanced by this time; it holds its last position at the end."""
        times = np.arange(self.position.size) + seconds * self.sampling_rate
        last = self.position.size - 1
        whole = np.minimum(times.astype(np.int64), last)
        part, after = np.minimum(times - whole, 1.0), np.minimum(whole + 1, last)
        mixed = [(1.0 - part) * signal[whole] + part * signal[after] for signal in (self.position, self.speed, self.acceleration)]
        return SampledPath(self.sampling_rate, *mixed)


def s_curve(places: Sequence[float], bounds: Bounds, sampling_rate: float, settle: float = SETTLE) -> SampledPath:
    """Moves between positions, m, each as fast as the bounds allow, with rests of ``settle`` s before, between and after them.

    A move is a step of position through three moving averages whose lengths are distance / speed, speed / acceleration and acceleration / jerk,
    so that speed, acceleration and jerk stay within their bounds. Source: Biagiotti & Melchiorri, Trajectory Planning for Automatic Machines and
    Robots, Springer 2008, sec. 4.5. Raises BadInput for fewer than two places.
    """
    if len(places) < 2:
        raise BadInput("places", f"{len(places)}", "two or more", "Give where the path goes.")
    parts = [np.full(max(round(settle * sampling_rate), 2), float(places[0]))]
    for start, end in itertools.pairwise(places):
        way = abs(end - start)
        if way == 0.0:
            continue
        step = np.concatenate([_move(way, bounds, sampling_rate), np.full(max(round(settle * sampling_rate), 2), way)])
        parts.append(start + math.copysign(1.0, end - start) * step)
    return of_position(np.concatenate(parts), sampling_rate)


def _move(way: float, bounds: Bounds, rate: float) -> FloatArray:
    """(n,) from 0 to ``way``."""
    speed = min(bounds.speed, math.sqrt(way * bounds.acceleration), (0.5 * way * way * bounds.jerk) ** (1.0 / 3.0))
    lasting = [way / speed, speed / bounds.acceleration, min(bounds.acceleration / bounds.jerk, math.sqrt(speed / bounds.jerk))]
    lengths = [max(math.ceil(seconds * rate), 1) for seconds in lasting]
    step = np.full(sum(lengths) + 1, way)
    step[0] = 0.0
    for length in lengths:
        total = np.cumsum(np.concatenate((np.zeros(length), step)))
        step = (total[length:] - total[:-length]) / length
    return np.asarray(step)


def of_position(position: FloatArray, sampling_rate: float) -> SampledPath:
    """A path through positions (n,), m, with central differences."""
    speed = np.gradient(position) * sampling_rate
    acceleration = np.zeros_like(position)
    acceleration[1:-1] = (position[2:] - 2.0 * position[1:-1] + position[:-2]) * sampling_rate**2
    return SampledPath(sampling_rate, position, speed, acceleration)


def recorded(position: FloatArray, sampling_rate: float, below: float) -> SampledPath:
    """The measured position (n,), m, low-passed without delay; below: cut-off, Hz. Raises BadInput if the recording is too short."""
    top = 0.45 * sampling_rate
    if position.size < 64:
        raise BadInput("samples of the recording", f"{position.size}", "64 or more", "Give a longer one.")
    sos = scipy.signal.butter(ORDER, min(below, top), fs=sampling_rate, output="sos")
    return of_position(np.asarray(scipy.signal.sosfiltfilt(sos, position - position[0]) + position[0]), sampling_rate)
