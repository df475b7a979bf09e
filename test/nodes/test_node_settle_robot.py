"""Experiments until a diagnosis is settled, on a robot that accepts only trajectories, over real DDS.

The controller is ``xy_sim.trajectory_node``: topic, interpolation and refusals of ros2_controllers around a simulated joint.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import cli
from helpers.ros_tools import World, needs_ros

from xy_sysid.experiment_design.loop import Budget

pytestmark = needs_ros
JOINT, TOPIC = "shoulder_pan_joint", "/joint_trajectory_controller/joint_trajectory"
RUN = {node["executable"]: node["parameters"] for node in yaml.safe_load((ROOT / "config" / "ros2_trajectory.yaml").read_text())["nodes"]}
SETS = (("gravity",), ("return_spring",))
LIMITS = {"limit": 1.2, "max_speed": 3.0, "max_acceleration": 30.0, "travel_min": -1.6, "travel_max": 1.6}
SMALL = {"rms": 0.0, "low": 0.4, "high": 5.0, "period": 10.24}
DIAGNOSER = """
import rclpy
rclpy.init(args=["--ros-args", "-r", "__ns:=/xy"])
node = rclpy.create_node("diagnoser")
for name, value in {"effort_lag": 1, "input_unit": "A", "effort_as_voltage": True}.items():
    node.declare_parameter(name, value)
rclpy.spin(node)
"""


def test_what_pulls_the_joint_back_is_found_by_a_designed_trajectory(world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Near hanging, gravity and a spring look the same. The designed motion stays within the limits of the joint, and names gravity.

    The effort is read as the diagnoser reads it. The decisions can be repeated from the bags, and the settings are as before.
    """
    from sensor_msgs.msg import JointState
    from trajectory_msgs.msg import JointTrajectory

    from xy_sysid.nodes.settle import Settler, Wishes

    monkeypatch.setenv("ROS_DOMAIN_ID", str(world.domain))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    world.start("xy_sim.trajectory_node", {"joints": f'["{JOINT}"]', "update_rate": 50.0, "effects": '["gravity=0.4"]'})
    world.start(DIAGNOSER)
    told: dict[str, Any] = {**RUN["excitation"], "watchdog": 3.0, "horizon": 2.0, "rate": 50.0, "x": {**RUN["excitation"]["x"], **LIMITS, **SMALL}}
    told |= {f"x.{name}": value for name, value in told.pop("x").items()}
    drive = world.start("xy_sysid.nodes.excitation", {name: f'"{value}"' if isinstance(value, str) else value for name, value in told.items()})
    sent, states = world.hears(JointTrajectory, TOPIC, 1000), world.hears(JointState, "/joint_states", 1000)
    assert world.until(lambda: bool(states) and "diagnoser" in world.node.get_node_names(), 30.0)
    said: list[str] = []
    folder = tmp_path / "walk"
    wishes = Wishes("x", folder, SETS, Budget(experiments=1, seconds=20.0, draws=1), first=7.0, alone=True)

    def ended() -> bool:
        world.spin(0.005)
        return False

    settler = Settler(wishes, said.append, ended, lambda: True)
    try:
        assert settler.run(), (said, settler.problem, drive.output())
        after = settler.settings()
    finally:
        settler.close()
    assert len(settler.steps) == 2, (said, drive.output())
    first, last = settler.steps
    assert set(map(tuple, first["left"])) == set(SETS) and first["words"].startswith("the motion of "), said
    assert " A" in first["words"] and "N m" not in first["words"]
    assert last["chosen"] == ["gravity"] and last["experiments"] == 1, said
    assert after.experiment == "" and after.duration == 0.0 and after.axes["x"].kind == "multisine"
    experiment = yaml.safe_load((folder / "next_1.yaml").read_text())["experiment"]
    motion = np.loadtxt(folder / experiment["motion"], delimiter=",", skiprows=1)
    assert np.ptp(motion[:, 1]) > 0.05 and np.abs(motion[:, 1] - motion[0, 1]).max() <= 0.85 * LIMITS["limit"]
    assert len(sent) > 30
    for message in sent:
        speed = np.array([point.velocities[0] for point in message.points])
        assert message.joint_names == [JOINT] and np.abs(speed).max() <= LIMITS["max_speed"] and speed[-1] == 0.0
    assert cli("next", "--replay", folder).code == 0
