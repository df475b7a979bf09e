"""A robot that accepts only trajectories, from a JointTrajectoryController to its response, over real DDS.

The controller is ``xy_sim.trajectory_node``: topic, interpolation and refusals of ros2_controllers around a simulated joint.
"""

from __future__ import annotations

import signal
from typing import Any

import numpy as np
import yaml
from helpers import ROOT
from helpers.live_nodes import newest
from helpers.ros_tools import NodeProcess, World, needs_ros

from xy_sysid.samples.block import FloatArray

pytestmark = needs_ros

JOINT, TOPIC = "shoulder_pan_joint", "/joint_trajectory_controller/joint_trajectory"
RUN = {node["executable"]: node["parameters"] for node in yaml.safe_load((ROOT / "config" / "ros2_trajectory.yaml").read_text())["nodes"]}
LIMITS = RUN["excitation"]["x"]


def start(world: World, executable: str, **more: Any) -> NodeProcess:
    """A node as in the run file, with a watchdog and a horizon for busy computers.

    A longer horizon makes messages that take longer than a cycle of the controller to read.
    """
    arguments = more.pop("arguments", ())
    told = {**RUN[executable], **({"watchdog": 3.0, "horizon": 1.0} if executable == "excitation" else {})}
    axis = {f"x.{name}": value for name, value in told.pop("x", {}).items()}
    written = {name: f'"{value}"' if isinstance(value, str) else value for name, value in {**told, **axis, **more}.items()}
    return world.start(f"xy_sysid.nodes.{executable}", written, arguments=arguments)


def controller(world: World, **more: Any) -> NodeProcess:
    return world.start("xy_sim.trajectory_node", {"joints": f'["{JOINT}"]', "update_rate": 200.0, **more})


def trajectories(world: World) -> list[Any]:
    """A list that fills with the messages to a controller."""
    from trajectory_msgs.msg import JointTrajectory

    return world.hears(JointTrajectory, TOPIC, 100)


def arrays(world: World, topic: str) -> list[Any]:
    """A list that fills with a node's results."""
    from std_msgs.msg import Float64MultiArray

    return world.hears(Float64MultiArray, topic)


def places(world: World) -> list[float]:
    """A list that fills with the positions of the joint."""
    from sensor_msgs.msg import JointState

    seen: list[float] = []
    world.node.create_subscription(JointState, "/joint_states", lambda message: seen.append(message.position[message.name.index(JOINT)]), 1000)
    return seen


def of(message: Any) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n,) times of the points, ROS time in s; positions; speeds."""
    begins = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    times = np.array([begins + point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points])
    return times, np.array([point.positions[0] for point in message.points]), np.array([point.velocities[0] for point in message.points])


def within_limits(heard: list[Any]) -> None:
    """Check every sent message: position, speed and acceleration, and rest at its end."""
    for message in heard:
        times, position, speed = of(message)
        assert message.joint_names == [JOINT] and (np.diff(times) > 0).all()
        assert np.abs(position - heard[0].points[0].positions[0]).max() <= LIMITS["limit"]
        assert np.abs(speed).max() <= LIMITS["max_speed"] * (1 + 1e-9)
        assert np.abs(np.diff(speed) / np.diff(times)).max() <= LIMITS["max_acceleration"] * 1.001
        assert speed[-1] == 0.0


def test_a_robot_that_takes_only_trajectories_is_identified_and_stopped(world: World) -> None:
    """With the run file of the package: the reference as instrument gives the joint's gain, as input the response of joint and controller.

    STOP brakes within the limits, to rest.
    """
    from std_msgs.msg import Bool

    from xy_sysid.nodes.common import LATCHED_QOS

    control = controller(world, load=0.1)
    short = {"length": 512, "band_low": 1.0}
    start(world, "identifier", numerator_order=0, denominator_order=2, **short)
    command = {"effort_as_voltage": False, "effort_lag": 0, "response": "h1", "input_unit": "rad", "integrators": 0}
    plain = ("-r", "__ns:=/plain", "-r", "voltage:=/xy/voltage")
    start(world, "identifier", arguments=plain, numerator_order=0, denominator_order=3, **short, **command)
    heard, seen, statuses, whole = trajectories(world), places(world), world.statuses(), arrays(world, "/plain/frf/x")
    drive = start(world, "excitation", **{"x.period": 2.56, "x.low": 0.8})
    assert world.until(lambda: bool(seen) and bool(newest(statuses, "streams")), 60.0), control.output()
    assert world.transition("excitation", "configure"), drive.output()
    assert "rms" in drive.output() and "(acceleration)" in drive.output()
    assert world.transition("excitation", "activate"), drive.output()
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) >= 8, 120.0), drive.output() + control.output()
    wanted = ("gain 95 % low", "gain (rad/s/(N m))", "gain 95 % high")
    assert world.until(lambda: all(newest(statuses, "axis x").get(key) for key in wanted), 30.0)
    low, gain, high = (float(newest(statuses, "axis x")[key]) for key in wanted)
    assert abs(gain - 3.0) < max(3.5 / 3.92 * (high - low), 0.15), (low, gain, high)

    def is_the_loop() -> bool:
        """The newest response is that of the stand-in: its delay plus 1.5 of its cycles. With few windows a line may have a large error."""
        f, real, imaginary, _, _ = np.array(whole[-1].data).reshape(-1, 5).T if whole else np.zeros((5, 0))
        used = (f > 1.0) & (f < 4.0)
        s = 2j * np.pi * f[used]
        loop = (15.0 + 0.3 * s) * 3.0 / (s * (s / 40.0 + 1.0)) * np.exp(-0.0073 * s)
        closed, measured = loop / (1.0 + loop), (real + 1j * imaginary)[used]
        return bool(used.any()) and bool(np.median(np.abs(np.abs(measured) - np.abs(closed))) < 0.1)

    assert world.until(is_the_loop, 60.0), whole and whole[-1]
    stop = world.node.create_publisher(Bool, "stop", LATCHED_QOS)  # whoever subscribes hears it, however late it is discovered
    stop.publish(Bool(data=True))
    assert world.until(lambda: world.state("excitation") == "inactive", 20.0), drive.output()
    assert "STOP is on" in drive.output()
    world.spin(1.0)
    rests, ends = len(seen), of(heard[-1])[1][-1]
    world.spin(0.5)
    assert np.ptp(seen[rests:]) < 0.05 and abs(np.mean(seen[rests:]) - ends) < 0.05, control.output()  # the load continues
    within_limits(heard)
    assert "Traceback" not in drive.output() + control.output()


def test_whoever_falls_silent_the_joint_comes_to_rest(world: World) -> None:
    """Exceeded limits are refused at configure, a topic without a subscriber of trajectories at activate.

    If joint states stop, the excitation brakes and becomes inactive with a reason. After a killed sender, the joint ends at its last rest point.
    """
    drive = start(world, "excitation", watchdog=1.0, **{"x.rms": 0.1})
    assert not world.transition("excitation", "configure")
    assert "x.rms is 0.1 rad; allowed: up to" in drive.output() and "x.max_acceleration would be exceeded" in drive.output()
    changed, why = world.set_parameter("excitation", "x.rms", 0.0)
    assert changed, why
    assert world.transition("excitation", "configure") and not world.transition("excitation", "activate")
    assert f"trajectories would go to {TOPIC}, and no node subscribes to it: activate is refused" in drive.output()
    control = controller(world)
    heard, seen = trajectories(world), places(world)
    assert world.until(lambda: bool(seen), 60.0), control.output()
    assert world.until(lambda: world.transition("excitation", "activate"), 20.0), drive.output()
    assert world.until(lambda: len(heard) > 3 and len(seen) > 400 and np.ptp(seen[-100:]) > 0.002, 60.0), drive.output() + control.output()

    control.send(signal.SIGSTOP)
    assert world.until(lambda: "inactive: no position from the machine" in drive.output(), 30.0), drive.output()
    world.spin(0.3)
    spans = [float(np.ptp(of(message)[0])) for message in heard[-2:]]
    assert spans[1] < 0.3 < spans[0]  # the way to rest instead of the motion of the horizon
    within_limits(heard)
    control.send(signal.SIGCONT)

    heard.clear()
    moves = len(seen)
    assert world.until(lambda: len(seen) > moves + 200 and np.ptp(seen[-100:]) < 1e-3, 30.0), control.output()
    assert world.until(lambda: world.transition("excitation", "activate"), 20.0), drive.output()
    assert world.until(lambda: len(heard) > 3 and np.ptp(seen[-100:]) > 0.002, 60.0), drive.output() + control.output()
    drive.send(signal.SIGKILL)
    drive.wait()
    moves = len(seen)
    assert world.until(lambda: len(seen) > moves + 600 and np.ptp(seen[-100:]) < 1e-3, 30.0), control.output()
    ends = np.array([of(message)[1][-1] for message in heard[-2:]])  # a message of a sender that ends may reach one subscriber and not the other
    assert np.abs(ends - float(np.mean(seen[-100:]))).min() < 1e-3, (np.mean(seen[-100:]), ends)
    within_limits(heard)
