"""A substitute for a robot that accepts only trajectories: a JointTrajectoryController and a position loop around a simulated machine.

As ``controller_node`` with the interface position, except for the topic and the reference.

    python -m xy_sim.trajectory_node --ros-args -p joints:="[shoulder_pan_joint]" -p update_rate:=200.0
"""

from __future__ import annotations

import sys

import numpy as np
from rclpy.qos import qos_profile_system_default
from trajectory_msgs.msg import JointTrajectory

from xy_sim.controller_node import ControllerNode
from xy_sim.following import Following, Point
from xy_sysid.nodes.run import run_node
from xy_sysid.samples.block import FloatArray


class TrajectoryNode(ControllerNode):
    """Receives trajectories and publishes joint states at a fixed rate."""

    def __init__(self) -> None:
        self._following: Following | None = None
        super().__init__()

    def _listen(self, joints: list[str]) -> str:
        controller = str(self.declare_parameter("trajectory_controller", "/joint_trajectory_controller").value)
        self._following = Following(joints)
        topic = f"{controller}/joint_trajectory"
        self.create_subscription(JointTrajectory, topic, self._on_trajectory, qos_profile_system_default)
        return f"{controller} (trajectories)"

    def _on_trajectory(self, message: JointTrajectory) -> None:
        assert self._following is not None
        points = [
            Point(
                at=point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec,
                position=np.array(point.positions),
                speed=np.array(point.velocities),
                push=np.array(point.accelerations),
            )
            for point in message.points
        ]
        none = np.zeros(len(self._joints))
        stamp = message.header.stamp
        why = self._following.take(
            message.joint_names, points, stamp.sec + 1e-9 * stamp.nanosec, self._time(), Point(0.0, self._position, none, none)
        )
        if why:
            self.get_logger().error(why)

    def _time(self) -> float:
        return float(self.get_clock().now().nanoseconds * 1e-9)

    def _update(self, command: FloatArray | None, speed: FloatArray) -> FloatArray:
        """(joints,) effort of the loop that follows the trajectory; zeros before the first trajectory."""
        wanted = self._following.now(self._time()) if self._following is not None else None
        if wanted is None:
            return np.zeros(len(self._joints))
        return np.asarray(self._stiffness * (wanted[0] - self._position) + self._damping * (wanted[1] - speed))


def main() -> int:
    """Run the node; returns the exit code of the process."""
    return run_node(TrajectoryNode)


if __name__ == "__main__":
    sys.exit(main())
