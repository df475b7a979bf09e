"""The lines of the documents that begin with ``ros2``: their topics and services exist with the given types while the documented programs run.

The ros2 command is not available as a wheel. The test makes its calls: lifecycle, services and parameters, topics with their types.
"""

from __future__ import annotations

import re
import shlex
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import cli
from helpers.ros_tools import NodeProcess, needs_ros, world_in

pytestmark = needs_ros

PAGES = ("ros2-control.md", "topics.md", "real-machine-safely.md")
ELSEWHERE = ("run", "bag")  # programs of other packages


def lines(*verbs: str) -> list[list[str]]:
    """The words of every documented ros2 command with this start."""
    text = "\n".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in PAGES)
    found = [shlex.split(line, comments=True)[1:] for line in re.findall(r"^    (ros2 .*)$", text, re.MULTILINE)]
    assert {words[0] for words in found} <= {"lifecycle", "topic", "service", "param", *ELSEWHERE}
    return [words for words in found if tuple(words[: len(verbs)]) == verbs]


def filled(message: Any, values: Mapping[str, Any]) -> None:
    """Fill a message like ``ros2 topic pub``: every key must be a field. Raises AttributeError for any other key."""
    for name, value in values.items():
        own = getattr(message, name)
        if isinstance(value, Mapping):
            filled(own, value)


def test_what_the_documents_type_is_there_when_the_documented_programs_run(tmp_path: Path) -> None:
    """The stand-in and the run file of ros2-control.md: transitions, calls and parameters work as documented; topics have their types.

    Only the watchdog is longer than in the file: a stall of a busy computer would stop the excitation too early.
    """
    from std_srvs.srv import Trigger

    stand_in = re.search(r"^    python -m (xy_sim\.controller_node) --ros-args (.*)$", (ROOT / "docs/ros2-control.md").read_text(), re.MULTILINE)
    assert stand_in is not None
    with world_in(tmp_path) as world:
        control = NodeProcess(("-m", stand_in[1]), ["--ros-args", *shlex.split(stand_in[2])], world.domain, tmp_path / "control.log")
        world.processes.append(control)
        documented = yaml.safe_load((ROOT / "config/ros2_control.yaml").read_text(encoding="utf-8"))
        (excitation,) = [node for node in documented["nodes"] if node["executable"] == "excitation"]
        excitation["parameters"]["watchdog"] = 3.0
        (tmp_path / "run.yaml").write_text(yaml.safe_dump(documented), encoding="utf-8")
        run = NodeProcess(("-m", "xy_sysid"), ["run", "--params", str(tmp_path / "run.yaml")], world.domain, tmp_path / "run.log")
        world.processes.append(run)
        said = world.statuses()
        assert world.until(lambda: any(status.name == "streams" for status in said), 90.0), run.output() + control.output()

        for _, _, node, label in lines("lifecycle", "set")[:2]:
            assert world.transition(node.removeprefix("/xy/"), label), run.output()
        assert [words[3] for words in lines("lifecycle", "set")] == ["configure", "activate"] * 2 + ["configure", "activate", "deactivate"]

        services = dict(world.node.get_service_names_and_types())
        for words in lines("service", "call"):
            name, kind = words[2:4]
            assert services.get(name) == [kind], (name, sorted(services))
        answer = world.call(Trigger, "/xy/diagnoser/diagnose", Trigger.Request(), 60.0)
        assert isinstance(answer.message, str)

        for words in lines("param", "set"):
            node, name, value = words[2].removeprefix("/xy/"), words[3], yaml.safe_load(words[4])
            changed, why = world.set_parameter(node, name, value)
            assert changed, why

        topics = dict(world.node.get_topic_names_and_types())
        for words in lines("topic", "echo"):
            assert words[2] in topics, (words, sorted(topics))
        stop = next(words for words in lines("topic", "pub") if words[3] == "/xy/stop")
        assert topics[stop[3]] == [stop[4]] and yaml.safe_load(stop[5]) == {"data": True}
        assert world.transition("excitation", "deactivate"), run.output()
        run.send(signal.SIGINT)
        assert run.wait(30.0) in (0, 130), run.output()


def test_the_trajectory_that_is_published_has_the_fields_of_the_message(tmp_path: Path) -> None:
    """excite.yaml of ``xy-sysid trajectory``, as documented: ``ros2 topic pub`` can publish it as a JointTrajectory."""
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    text = (ROOT / "docs" / "ros2-control.md").read_text(encoding="utf-8")
    asked = re.search(r"^    xy-sysid trajectory (\S+) (.*)$", text, re.MULTILINE)
    assert asked is not None
    told = cli("trajectory", tmp_path / asked[1], *shlex.split(asked[2]))
    assert told.code == 0, told.err
    values = yaml.safe_load((tmp_path / asked[1]).read_text(encoding="utf-8"))
    points = values.pop("points")
    filled(JointTrajectory(), values)
    filled(JointTrajectoryPoint(), points[0])
    assert ["topic", "pub", "--once", "/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory"] in [
        words[:5] for words in lines("topic", "pub")
    ]
    with pytest.raises(AttributeError):
        filled(JointTrajectory(), {"pionts": []})
