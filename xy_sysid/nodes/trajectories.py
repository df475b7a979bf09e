"""What a JointTrajectoryController hears: trajectory_msgs/JointTrajectory, with stamps, of which each ends at rest.

A new message replaces the one before. Points before the present are passed over, so pieces of one motion that overlap are one motion.
Points with accelerations are joined by polynomials of fifth order, those without, while it brakes, of third order: there the acceleration is
constant and jumps at its ends.
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
HOLDS = 0.1  # s in which a joint that was held back is told to stay where it is


class Trajectories(Commands):
    """As ``Commands``."""

    says = JointTrajectory

    def send(self, drive: Drive, values: FloatArray, at: float) -> bool:
        """See ``Commands``: the piece that is due; the others of the controller's joints stay where they are."""
        assert isinstance(drive, TrajectoryDrive)
        if not np.isfinite(self._of_all(values, self._kept)).all():
            return False
        points = drive.message()
        if points is not None:
            begins = at + (drive.stamp_from + float(points.sample[0]) - (drive.seq - 1)) / drive.settings.rate
            self.publisher.publish(self._message(points, begins, drive.settings.rate))
        return True

    def rest(self, drive: Drive) -> None:
        """See ``Commands``: a controller brakes by itself at the end of what it was told; a joint that something held back stays there."""
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
