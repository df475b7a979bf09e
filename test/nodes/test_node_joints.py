"""Two joints named pan and joint-2, in any order, from joint states to every use of an axis name, over real DDS."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import cli
from helpers.live_nodes import newest
from helpers.ros_tools import World, needs_ros

pytestmark = needs_ros

AXES = ["joint-2", "pan"]
HEARS: dict[str, Any] = {"source": "joint_state", "joint_topic": "/joint_states", "effort_as_voltage": True, "effort_lag": 1}
UNITS = {"input_unit": "N m", "output_unit": "rad"}
JOINT = {"rms": 1.0, "limit": 2.0, "centring": 0.5, "velocity_gain": 3.0, "breakaway": 0.4, "travel_min": -20.0, "travel_max": 20.0, "brake": 3.0}


def files(folder: Path) -> tuple[Path, Path]:
    """A machine of two joints, and the parameters of all nodes, with names that a command line cannot accept."""
    joint = yaml.safe_load((ROOT / "config" / "machines" / "joint.yaml").read_text(encoding="utf-8"))
    machine, parameters = folder / "machine.yaml", folder / "nodes.yaml"
    wide = {**joint["axes"]["x"], "travel": 100.0}  # on a stall of a busy computer, the stand-in continues with its last effort
    machine.write_text(yaml.safe_dump({**joint, "axes": {"pan": wide, "joint-2": wide}}))
    drives = {"axes": AXES, "output": "commands", "unit": "rad", "joint_topic": "/joint_states", "controller_joints": ["pan", "joint-2"]}
    nodes = {
        "excitation": {**drives, "rate": 100.0, "watchdog": 5.0, **{axis: {**JOINT, "high": 30.0} for axis in AXES}},
        "identifier": {**HEARS, **UNITS, "axes": AXES, "length": 128, "band_high": 30.0, "numerator_order": 0, "denominator_order": 2},
        "diagnoser": {**HEARS, **UNITS, "axes": AXES[::-1], "minimum": 4.0, "tolerance": 0.01, "effects": {axis: [""] for axis in AXES}},
        "recorder": {"output": str(folder / "bag"), "topics": ["/joint_states", "frf/.*", "metrics"]},
    }
    told = {f"/xy/{name}": {"ros__parameters": values} for name, values in nodes.items()}
    parameters.write_text(json.dumps(told))  # YAML without aliases, which rcl does not support
    return machine, parameters


def test_two_joints_of_any_name_go_through_every_node_the_page_and_the_bag(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    """Driven, identified, diagnosed, shown, recorded, replayed and diagnosed offline, each with its name and its units."""
    from std_srvs.srv import Trigger

    from xy_sysid.cli.monitor import Monitor
    from xy_sysid.page.link import Link
    from xy_sysid.page.topics_state import TopicsState

    machine, parameters = files(world.folder)
    statuses, told = world.statuses(), world.statuses("diagnosis")
    given = ["--params-file", str(parameters)]
    control = {"joints": '["pan", "joint-2"]', "machine": str(machine), "update_rate": 100.0, "effects": '["coulomb_friction"]'}
    world.start("xy_sim.controller_node", control)
    for module in ("identifier", "diagnoser", "recorder"):
        world.start(f"xy_sysid.nodes.{module}", arguments=given)
    drive = world.start("xy_sysid.nodes.excitation", arguments=given)
    assert world.until(lambda: bool(newest(statuses, "diagnoser")) and bool(newest(statuses, "streams")), 60.0)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(world.domain))
    heard = TopicsState()
    link, monitor = Link(heard, "/xy", lambda words: None), Monitor(tuple(AXES))
    try:
        assert world.transition("excitation", "configure") and world.transition("excitation", "activate"), drive.output()

        halted: list[str] = []

        def driving() -> None:
            """Drive again if a guard mistook stalls of the stand-in on a busy computer for an encoder fault."""
            if newest(statuses, "excitation").get("state") == "stopped":
                halted.append("while it was diagnosed")
                statuses.clear()
                again = world.transition("excitation", "activate")
                assert again or world.state("excitation") == "active", drive.output()  # an old status

        def all_there() -> bool:
            monitor.spin(0.01)
            return all(int(newest(statuses, f"axis {axis}").get("windows", "0")) >= 12 for axis in AXES)

        def shown() -> bool:
            monitor.spin(0.01)
            return {"frf/joint_2", "frf/pan"} <= set(monitor.arrays)

        def near() -> bool:
            """The true value is 3; friction changes it, and so do stalls of the stand-in until enough data are between them."""
            driving()
            monitor.spin(0.01)
            return all(1.0 < float(newest(statuses, f"axis {axis}").get("gain (rad/s/(N m))", "nan")) < 4.0 for axis in AXES)

        assert world.until(all_there, 60.0), drive.output()
        assert world.until(near, 60.0), newest(statuses, "axis pan") | newest(statuses, "axis joint-2")
        for axis in AXES:
            assert heard.table("frf", axis) is not None and heard.units(f"axis {axis}") == ("N m", "rad")
        assert heard.axes() == ("joint-2", "pan") and heard.units("excitation") == ("N m", "rad")
        assert world.until(shown)
        for _ in range(12):  # a busy computer loses samples, and some seconds without a gap are needed
            driving()
            answer = world.call(Trigger, "/xy/diagnoser/diagnose", Trigger.Request(), 120.0)
            if answer.message.count("Missing: coulomb_friction") == 2:
                break
            world.spin(3.0)
        assert "axis joint-2: Missing: coulomb_friction" in answer.message and "axis pan: Missing: coulomb_friction" in answer.message
        assert " mrad/s" in answer.message and " mm/s" not in answer.message
        assert world.until(lambda: bool(newest(told, "axis joint-2")) and {"joint-2", "pan"} <= set(heard.stories))
        stood = halted or newest(statuses, "excitation").get("state") == "stopped"
        if stood or any(newest(statuses, f"axis {axis}").get("dropped windows", "0") != "0" for axis in AXES):
            for _ in range(6):  # so that the bag has enough motion
                driving()
                world.spin(5.0)
        named = newest(told, "axis joint-2")
        assert "error now (rad/s)" in named and not [key for key in named if "m/s" in key.replace("rad/s", "") or "V" in key]
    finally:
        link.close()
        monitor.close()
    for process in world.processes:
        process.end()
    bag, chosen = world.folder / "bag", ("--topic", "joints=/joint_states", "--effort", "--effort-lag", "1", "--unit", "input=N m,output=rad")
    replayed = cli("replay", bag, "--params", parameters, "--json").json
    assert set(replayed["axes"]) == set(AXES) and replayed["units"] == {"input": "N m", "output": "rad"}
    found = cli("diagnose", bag, *chosen, "--joint", "arm=joint-2", "--axis", "arm", "--json")
    arm = found.json["axes"]["arm"]
    assert arm["effect"] == "coulomb_friction", (halted, arm["sentence"], found.json["notes"])
    assert os.environ["ROS_DOMAIN_ID"] == str(world.domain)
