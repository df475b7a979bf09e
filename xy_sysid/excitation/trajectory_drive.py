"""The drive of a robot that takes only trajectories: pieces of one motion, each of which ends at rest.

A message has the next ``horizon`` seconds and the braking after them; the next one follows before they are over. So the joint comes to rest
within its limits even if this computer fails. All guards of a position command act here too, by braking.
"""

from __future__ import annotations

import math

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation.designed import Planned
from xy_sysid.excitation.drive import LIVE, Drive
from xy_sysid.excitation.motion_plan import MotionPlan, MotionPoints
from xy_sysid.excitation.trajectory import MotionLimits, Trajectory, trajectory
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, knobs

PIECES = 5  # messages in a horizon: some may be lost
LEAD = 0.02  # s until a message reaches the controller, so that braking begins in its future; its clock may be ahead by less
BEHIND = 0.1  # s of past motion in a message; the controller's clock may be late by less


class TrajectoryDrive(Drive):
    """``Drive`` for trajectories; ``message`` returns the points for the controller."""

    def __init__(self, settings: ExcitationSettings, seq: int = 0, watched: bool = True, planned: Planned | None = None) -> None:
        """As ``Drive``; planned: motions of an experiment. Raises BadInput for a motion that exceeds its limits."""
        planned = planned or Planned()
        super().__init__(settings, seq, watched, planned.starts)
        self._motions = [planned.motions.get(name) or _motion(name, axis, settings) for name, axis in settings.axes.items()]
        self._plan: MotionPlan | None = None
        self._first = 0  # counter at the start of the plan
        self._told: int | None = None  # sample of the plan at the last message
        self._until = 0  # sample at which the controller brakes by the last message
        self._last_word = False  # the last message brakes

    def see(self, block: Block, overdue: int = 0) -> bool:
        """As ``Drive``; the motion begins at the first position of the joint, and returns to it."""
        usable = super().see(block, overdue)
        if usable and self._plan is None and self._start is not None and self.state == "active":
            axes = list(self.settings.axes.values())
            reach = np.array([0.0 if motion is None else axis.limit for axis, motion in zip(axes, self._motions, strict=True)])
            low, high = self._start - reach, self._start + reach
            outside = (low < self._travel.low) | (high > self._travel.high)
            if outside.any():
                k, unit = int(np.argmax(outside)), self.settings.unit
                ends = (low, high), (self._travel.low, self._travel.high)
                motion, travel = (f"from {one[k]:.4g} to {other[k]:.4g} {unit}" for one, other in ends)
                self.fault = True
                self.stop(
                    f"{self.axes[k]} stands at {self._start[k]:.4g} {unit}: its motion {motion} would leave its travel {travel}. "
                    "Move it to the middle, or lower limit",
                    0.0,
                )
                return True
            limits = np.array([axis.max_acceleration if axis.max_acceleration > 0.0 else np.inf for axis in axes])
            self._plan, self._first = MotionPlan(self._motions, self._start, self.settings.rate, limits), self.seq + self._lead
        return usable

    def _why_unusable(self, block: Block, overdue: int) -> str:
        why = super()._why_unusable(block, overdue)
        if why:
            return why
        late = (self.seq - 1 - float(block.seq[-1])) / self.settings.rate
        early = -late - overdue / self.settings.rate
        if late <= BEHIND and early <= LEAD:
            return ""
        when = "before" if late > BEHIND else "after"
        return (
            f"stamped {max(late, early):.3g} s {when} it comes: where trajectories are sent, the robot's clock may be "
            f"{LEAD:g} s ahead of this computer's and {BEHIND:g} s behind it (chrony, PTP)"
        )

    def stop(self, reason: str, seconds: float) -> None:
        """Brake at the limits of acceleration; ``seconds`` is not used for the motion."""
        was_active = self.state == "active"
        super().stop(reason, seconds)
        if was_active and self._plan is not None:
            self._plan.brake(self._sample + self._lead)

    def change(self, settings: ExcitationSettings) -> None:
        """As ``Drive``; settings of the motion cannot change while active."""
        before = {item.name: item.value for item in knobs(self.settings)}
        for item in knobs(settings):
            if self.state in ("active", "stopping") and item.name not in LIVE and before.get(item.name) != item.value:
                raise BadInput(
                    item.name, f"to change to {item.value} while active", f"as joint_trajectory: {', '.join(sorted(LIVE))}", "Deactivate first."
                )
        super().change(settings)

    def catch_up(self, missed: int) -> Block:
        """As ``Drive``; the controller continued meanwhile, up to the end of the last message."""
        if self._told is not None and self.state == "active" and self._sample + missed > self._until:
            assert self._plan is not None
            self._plan.brake(self._until)
            self.fault = True
            super().stop(
                f"this computer stood still for {missed / self.settings.rate:.2g} s, longer than horizon: the joint came to rest by itself", 0.0
            )
        return self.next(missed + 1)

    @property
    def safe(self) -> FloatArray:
        """As ``Drive``; once the motion brakes, its final position."""
        place = self._plan.place if self._plan is not None else None
        return super().safe if place is None else place

    @property
    def stopping_time(self) -> float:
        """Remaining time until rest, s; 0 while the motion does not brake."""
        rests = self._plan.rests if self._plan is not None else None
        return 0.0 if rests is None else max(rests - self._sample, 0) / self.settings.rate

    def message(self) -> MotionPoints | None:
        """The points for the controller, if a message is due; samples count from ``stamp_from``."""
        if self._plan is None or self.state not in ("active", "stopping", "stopped"):
            return None
        rate, now, brakes = self.settings.rate, self._sample, self._plan.rests is not None
        due = self._told is None or now - self._told >= self.settings.horizon * rate / PIECES
        if (brakes and self._last_word) or not (due or brakes):
            return None
        self._last_word = brakes
        if brakes and self.stopping_time == 0.0:
            return None  # it is at rest already
        self._told, self._until = now, now + round(self.settings.horizon * rate)
        return self._plan.ahead(now - math.ceil(BEHIND * rate), self._until)

    @property
    def stamp_from(self) -> int:
        """Counter of sample 0 of the plan."""
        return self._first

    @property
    def strayed(self) -> FloatArray | None:
        """(axes,) measured position, if it differs from the final position of the motion by more than the brake zone; otherwise None."""
        place = self._plan.place if self._plan is not None else None
        if place is None or self.state != "stopped" or self._travel.seen is None:
            return None
        away = np.abs(self._travel.seen.position - place) > self._travel.zone
        return self._travel.seen.position if bool(away.any()) else None

    @property
    def sizes(self) -> str:
        """The motion of each axis in words."""
        unit = self.settings.unit
        return "; ".join(
            f"{name}: rms {np.std(motion.position):.3g} {unit}, largest {np.max(np.abs(motion.position)):.3g} {unit}, "
            f"{np.max(np.abs(motion.speed)):.3g} {unit}/s and {np.max(np.abs(motion.acceleration)):.3g} {unit}/s^2 ({motion.limited_by})"
            for name, motion in zip(self.axes, self._motions, strict=True)
            if motion is not None
        )

    @property
    def _sample(self) -> int:
        return self.seq - self._first

    @property
    def _lead(self) -> int:
        return math.ceil(LEAD * self.settings.rate)

    def _reference(self, n: int) -> FloatArray:
        """(n, axes) positions of the plan."""
        self._begun += n
        return np.tile(self.safe, (n, 1)) if self._plan is None else self._plan.at(self._sample, n).position


def drive_of(settings: ExcitationSettings, seq: int = 0, planned: Planned | None = None) -> Drive:
    """The drive for these settings; planned: of an experiment. Raises BadInput if a signal does not fit the rate or the limits."""
    if settings.command == "joint_trajectory":
        return TrajectoryDrive(settings, seq, planned=planned)
    return Drive(settings, seq, starts=None if planned is None else planned.starts)


def _motion(name: str, axis: AxisExcitation, settings: ExcitationSettings) -> Trajectory | None:
    """One period about 0, with the set rms or the largest within the limits; None for an axis at rest. Raises BadInput for too large an rms."""
    if axis.kind == "off":
        return None
    room = axis.limit - 0.5 * axis.max_speed / settings.rate  # braking takes up to a sample longer than the limits allow
    limits = MotionLimits(room, axis.max_speed, axis.max_acceleration)
    try:
        largest = trajectory(axis.kind, (axis.low, axis.high), round(axis.period * settings.rate) / settings.rate, settings.rate, limits, axis.seed)
    except BadInput as problem:
        raise BadInput(f"{name}: {problem.what}", problem.value, problem.allowed, problem.act) from None
    rms, unit = float(np.std(largest.position)), settings.unit
    if axis.rms > rms * (1.0 + 1e-9):
        tight = {"position": "limit", "speed": "max_speed", "acceleration": "max_acceleration"}[largest.limited_by]
        raise BadInput(
            f"{name}.rms",
            f"{axis.rms:g} {unit}",
            f"up to {rms:.3g} {unit}, or {name}.{tight} would be exceeded",
            "Lower it, or set it to 0 for the largest.",
        )
    if axis.rms == 0.0:
        return largest
    part = axis.rms / rms
    return Trajectory(
        time=largest.time,
        position=part * largest.position,
        speed=part * largest.speed,
        acceleration=part * largest.acceleration,
        limited_by="rms",
    )
