"""Drivers with velocities and without positions, over real DDS: identified if configured, otherwise an error with the next action."""

from __future__ import annotations

import json

import numpy as np
import pytest
from helpers.live_nodes import Source, newest
from helpers.ros_tools import World, needs_ros

pytestmark = needs_ros

RATE = 125.0
HEARS = {"axes": json.dumps(["left", "right"]), "source": "joint_state", "effort_as_voltage": True, "input_unit": "N m", "output_unit": "rad/s"}
SHAPE = {"length": 256, "band_high": 60.0, "refit": 2.0, "numerator_order": 0, "denominator_order": 2}


def test_wheels_without_positions_are_identified_by_their_velocities_and_refused_in_words_by_who_waits_for_positions(world: World) -> None:
    """One stream, two nodes: output velocity gives gain and delay in rad; output position is an error with the required setting."""
    from sensor_msgs.msg import JointState

    statuses = world.statuses()
    identifier = world.start("xy_sysid.nodes.identifier", {**HEARS, **SHAPE, "output": "velocity"})
    diagnoser = world.start("xy_sysid.nodes.diagnoser", HEARS)
    source = Source(world, ("left", "right"), rate=RATE)
    velocity = np.diff(source.y, axis=0, prepend=0.0) * RATE  # a drive's difference of its encoder: of the previous sample
    publisher = world.node.create_publisher(JointState, "joint_states", 10_000)
    assert world.until(lambda: publisher.get_subscription_count() == 2, 40.0), identifier.output() + diagnoser.output()
    for n in range(3000):
        message = JointState(name=["right", "left"], velocity=velocity[n, ::-1].tolist(), effort=source.u[n, ::-1].tolist())
        if n % 2:
            message.position = [float("nan")] * 2
        if n == 1500:
            message.velocity[0] = float("nan")
        stamp = 5.0 + n / RATE
        message.header.stamp.sec, message.header.stamp.nanosec = int(stamp), round((stamp % 1) * 1e9)
        publisher.publish(message)
        if n % 100 == 0:
            world.spin(0.005)

    def done() -> bool:
        """All samples received, one lost, and a fit of those after it."""
        return newest(statuses, "streams").get("stream: not_finite") == "1" and int(newest(statuses, "axis left").get("windows", "0")) >= 17

    assert world.until(done, 30.0), identifier.output()
    for name in ("left", "right"):
        axis = newest(statuses, f"axis {name}")
        assert float(axis["gain (rad/s/(N m))"]) == pytest.approx(0.1, rel=0.03)
        assert float(axis["delay (s)"]) == pytest.approx(1.0 / RATE, rel=0.05)
        assert axis["dropped windows"] == "1" and axis["output unit"] == "rad"
    assert "the output is a velocity (rad/s): it is integrated" in identifier.output()
    assert world.until(lambda: "refused" in newest(statuses, "diagnoser").get("message", ""), 10.0)
    told = newest(statuses, "diagnoser")
    assert told["level"] == "2" and told["samples paired"] == "0" and told["message"].startswith("nothing is paired")
    assert "this driver gives velocity. Set output to velocity." in told["message"], told
    assert "joint_states: positions are empty; this driver gives velocity" in diagnoser.output()
