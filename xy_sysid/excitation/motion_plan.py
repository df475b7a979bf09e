"""A periodic motion from rest to rest, with braking from each of its samples within the acceleration limit.

Braking at the acceleration limit never exceeds the position limit: the motion itself reverses before that limit with at most this
acceleration, so there is always enough distance to stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class MotionPoints:
    """Samples of a motion.

    sample: (n,) counter from the start of the motion; position, speed, acceleration: (n, axes) rad or m, and per s and s^2
    brakes: index of the first braking point, n if none; acceleration is discontinuous there
    """

    sample: NDArray[np.int64]
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    brakes: int


class MotionPlan:
    """The motion of all axes about their present positions; ``brake`` ends it."""

    def __init__(self, motions: Sequence[Trajectory | None], start: FloatArray, rate: float, limits: FloatArray) -> None:
        """motions: one period of each axis about 0, None for an axis at rest; start: (axes,); rate: Hz; limits: (axes,) of acceleration."""
        self._motions, self._start, self._rate, self._limits = tuple(motions), start, rate, limits
        self._brake: int | None = None

    def brake(self, sample: int) -> None:
        """Brake from this sample on, unless it brakes earlier."""
        self._brake = sample if self._brake is None else min(self._brake, sample)

    @property
    def rests(self) -> int | None:
        """First sample at rest; None while the motion continues."""
        return None if self._brake is None else self._brake + int(np.max(self._steps(self._brake)))

    @property
    def place(self) -> FloatArray | None:
        """(axes,) final position; None while the motion continues."""
        rests = self.rests
        return None if rests is None else self.at(rests, 1).position[0]

    def at(self, first: int, n: int) -> MotionPoints:
        """The n planned samples from this one on."""
        return self._points(np.arange(first, first + n), self._brake)

    def ahead(self, first: int, last: int) -> MotionPoints:
        """The samples from first to last and the braking after them, so that a controller needs no further message."""
        brake = last if self._brake is None else min(last, self._brake)
        rest = brake + int(np.max(self._steps(brake)))
        return self._points(np.arange(first, max(rest, first) + 1), brake)

    def _points(self, sample: NDArray[np.int64], brake: int | None) -> MotionPoints:
        position, speed, push = self._moving(sample if brake is None else np.minimum(sample, brake))
        braking = np.zeros(sample.size, dtype=bool) if brake is None else sample > brake
        if brake is not None and bool(braking.any()):
            since = (sample[braking, None] - brake) / self._rate
            whole = self._steps(brake) / self._rate
            slows = np.where(whole > 0.0, speed[-1] / np.maximum(whole, 1e-300), 0.0)
            until = np.minimum(since, whole)
            position[braking] += speed[braking] * until - 0.5 * slows * until**2
            push[braking] = np.where(since < whole, -slows, 0.0)
            speed[braking] = np.where(since < whole, speed[braking] - slows * until, 0.0)
        return MotionPoints(sample=sample, position=position, speed=speed, acceleration=push, brakes=int(np.sum(~braking)))

    def _moving(self, sample: NDArray[np.int64]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, axes) position, speed, acceleration of the periodic motion without braking; at rest before its start."""
        shape = (sample.size, len(self._motions))
        position, speed, push = np.tile(self._start, (sample.size, 1)), np.zeros(shape), np.zeros(shape)
        for axis, motion in enumerate(self._motions):
            if motion is not None:
                place = np.where(sample > 0, sample % (motion.time.size - 1), 0)
                position[:, axis] += motion.position[place]
                speed[:, axis], push[:, axis] = motion.speed[place], motion.acceleration[place]
        return position, speed, push

    def _steps(self, sample: int) -> FloatArray:
        """(axes,) integer number of samples needed to stop from the speed at a sample."""
        speed = self._moving(np.array([sample]))[1][0]
        return np.asarray(np.ceil(np.abs(speed) * self._rate / self._limits - 1e-9))
