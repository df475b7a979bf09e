"""A reset clears everything that a node learned from the joint states, over real DDS."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.live_nodes import newest, ready
from helpers.ros_tools import World, needs_ros

pytestmark = needs_ros
HEARS: dict[str, Any] = {"axes": '["x"]', "source": "joint_state", "joint_topic": "/joint_states", "effort_as_voltage": True}
NODES = {"identifier": ("reset", "streams"), "diagnoser": ("forget", "diagnoser")}


def test_after_a_reset_the_driver_may_have_another_rate(world: World) -> None:
    """Half a minute at 250 Hz; after reset and forget, the rate of 200 Hz is found within two seconds."""
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    from xy_sysid.nodes.streams import JOINT_QOS

    publisher = world.node.create_publisher(JointState, "/joint_states", JOINT_QOS)
    statuses, random = world.statuses(), np.random.default_rng(1)
    logs = [world.start(f"xy_sysid.nodes.{name}", HEARS) for name in NODES]
    ready(world, statuses, "diagnoser", "streams")
    assert world.until(lambda: publisher.get_subscription_count() == len(NODES), 20.0)

    def drive(rate: float, count: int, start: float) -> None:
        """Joint states with these stamps, as fast as they go."""
        for number in range(count):
            message = JointState(name=["x"], position=[float(random.normal())], effort=[float(random.normal())])
            nanoseconds = round((start + number / rate) * 1e9)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 10**9)
            publisher.publish(message)
            if number % 20 == 0:
                world.spin(0.002)

    def known(rate: float) -> bool:
        return all(float(newest(statuses, status).get("sampling rate (Hz)", "0")) == pytest.approx(rate, rel=1e-4) for _, status in NODES.values())

    drive(250.0, 7500, 100.0)
    assert world.until(lambda: known(250.0), 20.0), [log.output() for log in logs]
    for name, (service, _) in NODES.items():
        assert world.call(Trigger, f"/xy/{name}/{service}", Trigger.Request(), times=3).success
    drive(200.0, 390, 140.0)
    assert world.until(lambda: known(200.0), 20.0), [newest(statuses, status) for _, status in NODES.values()]
