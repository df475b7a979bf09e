"""A substitute for a robot with ros2_control: joint_state_broadcaster and a forward controller around a simulated machine.

Topics, types, quality of service and sequence are those of a controller manager: in each period of the steady clock it reads the
joints (position, and the effort of the previous period), publishes ``joint_states`` with the ROS time of the reading, takes the newest
command of the right size, and writes an effort. A velocity or position command is the reference of a control loop in this node, as in
a drive. The machine moves in real time: a period that is missed is skipped, and the last effort acts during it. Like a controller
manager, the node requests real-time priority, and runs without it where that is not allowed.

    python -m xy_sim.controller_node --ros-args -p machine:=joint.yaml -p joints:="[shoulder-pan]" -p interface:=position
"""

from __future__ import annotations

import array
import os
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from rclpy.node import Node
from rclpy.qos import qos_profile_system_default
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.errors import BadInput
from xy_sysid.nodes.run import run_node
from xy_sysid.samples.block import FloatArray

INTERFACES = ("effort", "velocity", "position")
PRIORITY = 50  # of SCHED_FIFO, as ros2_control_node requests


class ControllerNode(Node):
    """Receives commands and publishes joint states at a fixed rate."""

    exit_code: int | None = None

    def __init__(self) -> None:
        super().__init__("controller_manager")
        machine = Machine.from_file(str(self.declare_parameter("machine", "joint.yaml").value))
        rate = float(self.declare_parameter("update_rate", 500.0).value or 0.0)
        effects = [str(text) for text in self.declare_parameter("effects", [""]).value or [] if text]
        machine = with_effects(Machine(replace(machine.spec, rate=rate)), effects)
        joints = [str(name) for name in self.declare_parameter("joints", [""]).value or [] if name] or list(machine.axes)
        self._interface = str(self.declare_parameter("interface", "effort").value)
        self._stiffness = float(self.declare_parameter("stiffness", 15.0).value or 0.0)  # effort per rad, of the position loop
        self._damping = float(self.declare_parameter("damping", 0.3).value or 0.0)  # effort per rad/s, of both loops
        self._integral = float(self.declare_parameter("integral", 10.0).value or 0.0)  # effort per rad, of the velocity loop
        self._load = float(self.declare_parameter("load", 0.0).value or 0.0)  # rms of an unmeasured load, in effort
        if self._interface not in INTERFACES:
            raise BadInput("interface", repr(self._interface), ", ".join(INTERFACES), "Choose one of these.")
        if len(joints) != len(machine.axes):
            raise BadInput("joints", ", ".join(joints), f"{len(machine.axes)} names", "Name each axis of the machine.")
        self._machine, self._joints, self._period = machine, joints, 1.0 / rate
        machine.step(np.zeros((1, len(joints))))  # compile in advance
        self._random = np.random.default_rng(machine.seed + 1)
        self._command: FloatArray | None = None
        self.heard: tuple[float, ...] = ()
        machine.reset()
        self._position = self._read()
        self._before, self._effort, self._sum = self._position, np.zeros(len(joints)), np.zeros(len(joints))
        self._states = self.create_publisher(JointState, "/joint_states", qos_profile_system_default)
        controller = self._listen(joints)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._manage, daemon=True)
        self._thread.start()
        self.get_logger().info(f"{', '.join(joints)} under {controller} at {rate:g} Hz")

    def _listen(self, joints: list[str]) -> str:
        """Subscribe to commands; returns the name of the controller and its kind of command."""
        controller = str(self.declare_parameter("controller", "/forward_command_controller").value)
        commands = f"{controller}/commands"
        self.create_subscription(Float64MultiArray, commands, self._on_command, qos_profile_system_default)
        return f"{controller} ({self._interface})"

    def _on_command(self, message: Float64MultiArray) -> None:
        if len(message.data) != len(self._joints):
            self.get_logger().error(f"command size ({len(message.data)}) does not match number of interfaces ({len(self._joints)})")
            return
        self._command = np.array(message.data, dtype=np.float64)

    def _manage(self) -> None:
        if not in_real_time():
            self.get_logger().warning("no real-time priority: on a busy computer cycles are missed")
        begun, cycle, missed = time.monotonic(), 0, 0
        while not self._over.is_set():
            self._cycle(missed)
            cycle += 1
            late = time.monotonic() - begun - cycle * self._period
            missed = max(int(late / self._period), 0)
            cycle += missed
            time.sleep(max(-late, 0.0))

    def _cycle(self, missed: int) -> None:
        """Read, update, write. missed: number of skipped periods since the last cycle."""
        if missed:
            self._machine.step(np.repeat(self._effort[None, :], missed, axis=0))
            self._position = self._read()
        speed = (self._position - self._before) / (self._period * (1 + missed))
        names = ["gripper", *reversed(self._joints)]  # other joints are included, in any order
        self._states.publish(
            JointState(
                header=self._header(),
                name=names,
                position=array.array("d", [0.0, *self._position[::-1]]),
                velocity=array.array("d", [0.0, *speed[::-1]]),
                effort=array.array("d", [np.nan, *self._effort[::-1]]),
            )
        )
        self._effort = self._update(self._command, speed)
        load = self._load * self._random.standard_normal(len(self._joints))
        self._machine.step((self._effort + load)[None, :])
        self._before, self._position = self._position, self._read()

    def _read(self) -> FloatArray:
        """(joints,) present readings of the motors' encoders, rad."""
        drives = [axis.drive for axis in self._machine.spec.axes]
        count = np.array([drive.count for drive in drives])
        noise = np.array([drive.encoder_noise for drive in drives]) * self._random.standard_normal(len(drives))
        place = np.array([self._machine.state(name)["motor"] for name in self._machine.axes])
        return np.asarray(np.round((place + noise) / count) * count)

    def _header(self) -> object:
        header = JointState().header
        header.stamp = self.get_clock().now().to_msg()
        return header

    def _update(self, command: FloatArray | None, speed: FloatArray) -> FloatArray:
        """The effort: the command itself, or the output of the loop."""
        if command is None:
            return np.zeros(len(self._joints))
        if self._interface == "effort":
            return command
        if self._interface == "velocity":
            self._sum = self._sum + (command - speed) * self._period
            return np.asarray(self._damping * (command - speed) + self._integral * self._sum)
        return np.asarray(self._stiffness * (command - self._position) - self._damping * speed)

    def ask_to_stop(self, reason: str) -> None:
        """Stop the clock."""
        self._over.set()

    def has_stopped(self) -> bool:
        """True once the thread of the clock has ended."""
        return not self._thread.is_alive()

    def last_words(self) -> None:
        """Nothing to publish."""
        self._over.set()
        self._thread.join()


def in_real_time() -> bool:
    """Request real-time priority for every thread of this process (all need the interpreter); False if it is not allowed."""
    try:
        for thread in Path("/proc/self/task").iterdir():
            os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, os.sched_param(PRIORITY))
    except (OSError, AttributeError):  # not permitted, or not Linux
        return False
    return True


def main() -> int:
    """Run the node; returns the exit code of the process."""
    return run_node(ControllerNode)


if __name__ == "__main__":
    sys.exit(main())
