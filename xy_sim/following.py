"""The reference of a JointTrajectoryController: polynomials between the points; a new trajectory replaces the present one.

Checks, skipped points and interpolation follow the source of joint_trajectory_controller in ros2_controllers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Point:
    """A point of a trajectory: time from its start, s; (joints,) positions, rad; their first and second derivatives, or empty arrays."""

    at: float
    position: FloatArray
    speed: FloatArray
    push: FloatArray


class Following:
    """``take`` reads a trajectory, ``now`` returns the reference of the joints."""

    def __init__(self, joints: Sequence[str]) -> None:
        """joints: names in the order of the controller."""
        self._joints = tuple(joints)
        self._points: list[Point] = []
        self._times = np.empty(0)
        self._begins = 0.0

    def take(self, names: Sequence[str], points: Sequence[Point], begins: float, now: float, state: Point) -> str:
        """Replace the trajectory; returns the reason for a refusal, or an empty text. begins: start time, s, 0 is now; state: of the joints now."""
        if sorted(names) != sorted(self._joints):
            return f"joints on incoming trajectory ({', '.join(names)}) don't match the controller joints ({', '.join(self._joints)})"
        times = np.array([point.at for point in points])
        if times.size == 0 or (np.diff(times) <= 0).any():
            return "time between points is not strictly increasing"
        if points[-1].speed.size and np.abs(points[-1].speed).max() > np.finfo(np.float32).eps:
            return "velocity of last trajectory point is not zero"
        if begins and begins + times[-1] < now:
            return f"received trajectory with non-zero start time ({begins:.6f}) that ends in the past ({begins + times[-1]:.6f})"
        order = [list(names).index(joint) for joint in self._joints]
        self._begins = begins or now
        mine = [Point(point.at, *(value[order] if value.size else value for value in (point.position, point.speed, point.push))) for point in points]
        before = Point(now - self._begins, state.position, state.speed, state.push)
        self._points = [before, *mine] if before.at < mine[0].at else mine
        self._times = np.array([point.at for point in self._points])
        return ""

    def now(self, now: float) -> tuple[FloatArray, FloatArray] | None:
        """(joints,) reference position, rad, and speed, rad/s, at time ``now``, s; None before the first trajectory."""
        if not self._points:
            return None
        since = now - self._begins
        k = int(np.searchsorted(self._times, since, side="right")) - 1
        if k >= self._times.size - 1:
            return self._points[-1].position, np.zeros(len(self._joints))
        one, other = self._points[max(k, 0)], self._points[max(k, 0) + 1]
        return _between(one, other, since - one.at)


def _between(one: Point, other: Point, since: float) -> tuple[FloatArray, FloatArray]:
    """Position and speed ``since`` (s) after point one, by a polynomial of order 5, 3 or 1: the derivatives that both points have."""
    known = 1 + int(one.speed.size > 0 and other.speed.size > 0)
    known += int(known == 2 and one.push.size > 0 and other.push.size > 0)
    length = other.at - one.at
    powers = np.arange(2 * known)
    rows, wanted = [], []
    for end, at in ((one, 0.0), (other, length)):
        factor = np.ones(2 * known)
        for order, value in enumerate((end.position, end.speed, end.push)[:known]):
            rows.append(factor * np.where(powers >= order, at ** np.maximum(powers - order, 0), 0.0))
            wanted.append(value)
            factor = factor * (powers - order)
    weights = np.linalg.solve(np.array(rows), np.array(wanted))
    speeds = np.where(powers >= 1, powers * since ** np.maximum(powers - 1, 0), 0.0)
    return since**powers @ weights, speeds @ weights
