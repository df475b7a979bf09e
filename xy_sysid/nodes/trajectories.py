"""Commands for a JointTrajectoryController: stamped trajectory_msgs/JointTrajectory messages that end at rest.

A new message replaces the one before. The controller skips points in the past, so overlapping pieces of one motion give one motion. It joins
points with accelerations by polynomials of fifth order, and those without, while braking, of third order: there the acceleration is constant and
jumps at its ends.
"""

from __future__ import annotations

import array

import numpy as np
from builtin_interfaces.msg import Duration, Time
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from xy_sysid.excitation.drive import Drive
from xy_sysid.excitation.motion_plan import MotionPoints
from xy_sysid.excitation.trajectory_drive import TrajectoryDrive
from xy_sysid.nodes.commands import Commands
from xy_sysid.samples.block import FloatArray

BILLION = 1_000_000_000
HOLDS = 0.1  # s after which a joint that was held back has to be at rest at its position


class Trajectories(Commands):
    """``Commands`` as trajectories."""

    says = JointTrajectory

    def send(self, drive: Drive, values: FloatArray, at: float) -> bool:
        """As ``Commands``: send the next piece, if it is due; the controller's other joints hold their positions."""
        assert isinstance(drive, TrajectoryDrive)
        if not np.isfinite(self._of_all(values, self._kept)).all():
            return False
        points = drive.message()
        if points is not None:
            begins = at + (drive.stamp_from + float(points.sample[0]) - (drive.seq - 1)) / drive.settings.rate
            self.publisher.publish(self._message(points, begins, drive.settings.rate))
        return True

    def rest(self, drive: Drive) -> None:
        """As ``Commands``: the controller brakes by itself at the end of a trajectory; a joint that was held back gets its present position."""
        assert isinstance(drive, TrajectoryDrive)
        strayed = drive.strayed
        if strayed is not None:
            point = self._point(HOLDS, self._of_all(strayed, self._kept), self._of_all(np.zeros_like(strayed), dict.fromkeys(self._others, 0.0)))
            self.publisher.publish(JointTrajectory(joint_names=list(self._order), points=[point]))

    def _message(self, points: MotionPoints, begins: float, rate: float) -> JointTrajectory:
        """begins: ROS time of the first point, s."""
        still = dict.fromkeys(self._others, 0.0)
        place, speed, push = (self._of_all(points.position, self._kept), self._of_all(points.speed, still), self._of_all(points.acceleration, still))
        since = (points.sample - points.sample[0]) / rate
        made = [self._point(float(since[k]), place[k], speed[k], push[k] if k < points.brakes else None) for k in range(since.size)]
        message = JointTrajectory(joint_names=list(self._order), points=made)
        message.header.stamp = Time(sec=int(begins), nanosec=int((begins - int(begins)) * BILLION))
        return message

    @staticmethod
    def _point(at: float, place: FloatArray, speed: FloatArray, push: FloatArray | None = None) -> JointTrajectoryPoint:
        seconds, rest = divmod(round(at * BILLION), BILLION)
        return JointTrajectoryPoint(
            positions=array.array("d", place),
            velocities=array.array("d", speed),
            accelerations=array.array("d", [] if push is None else push),
            time_from_start=Duration(sec=seconds, nanosec=rest),
        )
