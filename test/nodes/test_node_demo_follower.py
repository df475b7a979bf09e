"""The controller of the demo over real DDS: it uses models of stories, stops at STOP, and the tracking error falls on the simulated machine."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from helpers import ROOT
from helpers.ros_tools import HAS_ROS, World, needs_ros

from xy_sysid.control_design.follower import KINDS
from xy_sysid.samples.block import Block

if HAS_ROS:
    from std_msgs.msg import Float64MultiArray, String
    from std_srvs.srv import Trigger

    from xy_sysid.nodes.common import DATA_QOS, LATCHED_QOS
    from xy_sysid.nodes.convert import to_message

pytestmark = needs_ros

TRUTH: dict[str, dict[str, float]] = {
    "x": {"gain": 0.097, "delay": 1.29e-3, "pole": 246.0, "coulomb_friction.coulomb": 0.3},
    "y": {"gain": 0.0965, "delay": 1.38e-3, "pole": 244.0, "coulomb_friction.coulomb": 0.3},
}
MACHINE = """
base: {base}
axes:
  "x":
    parts: {{coulomb_friction: {{coulomb: 0.3}}}}
  "y":
    parts: {{coulomb_friction: {{coulomb: 0.3}}}}
"""


def story(axis: str) -> str:
    """A story as JSON; the controller reads only its model."""
    parameters = {name: {"value": value, "unit": "", "ci95": [0.999 * value, 1.001 * value]} for name, value in TRUTH[axis].items()}
    model = {"effects": ["coulomb_friction"], "parameters": parameters, "held_out_error": 3e-4, "noise_floor": 3e-4}
    return json.dumps({"axis": axis, "model": model, "sampling_rate": 2000.0, "units": {"input": "V", "output": "m"}})


def test_the_tracking_error_falls_from_pid_to_feedforward_to_compensation(world: World, tmp_path: Path) -> None:
    """Without a story it refuses. For a machine with dry friction kS, kV and kA halve the PID's error, and the compensation leaves a tenth."""
    file = tmp_path / "rubbing.yaml"
    file.write_text(MACHINE.format(base=ROOT / "config" / "machines" / "rigid.yaml"), encoding="utf-8")
    world.start("xy_sim.node", {"machine": str(file)})
    world.start("xy_sysid.nodes.demo_follower", {"distance": 0.01})
    heard, voltage, positions = world.statuses(), world.blocks(), world.blocks("position")

    def refused() -> Trigger.Response:
        return world.call(Trigger, "demo_follower/use", Trigger.Request(), 20.0, 3)

    assert world.until(lambda: "Press Diagnose" in refused().message, 30.0), refused()  # until it knows that the machine is the simulated one
    assert not refused().success
    for axis in TRUTH:
        world.node.create_publisher(String, f"story/{axis}", LATCHED_QOS).publish(String(data=story(axis)))
    drive, rows = world.node.create_publisher(Float64MultiArray, "voltage", DATA_QOS), np.arange(20.0)
    assert world.until(lambda: drive.get_subscription_count() > 1)
    drive.publish(to_message(Block(("x", "y"), rows, rows / 2000, np.zeros((20, 2)))))  # as at the end of the excitation: positions are now known
    assert world.until(lambda: bool(positions))
    assert world.until(lambda: world.call(Trigger, "demo_follower/use", Trigger.Request(), 20.0, 3).success, 20.0)

    def newest() -> dict[str, str]:
        found = [item for item in heard if item.name == "demo_follower"]
        return {pair.key: pair.value for pair in found[-1].values} | {"words": found[-1].message} if found else {}

    assert world.until(lambda: newest().get("state") in ("done", "failed"), 120.0), newest()
    values = newest()
    assert values["state"] == "done", values
    for axis in TRUTH:
        alone, simple, best = (float(values[f"axis {axis} {name} (m)"]) for name in KINDS)
        assert simple < 0.5 * alone and best < 0.1 * simple, values
        assert values[f"axis {axis} undone"] == "base, coulomb_friction"
    assert not voltage[-1].values.any()
