"""Node diagnoser over real DDS: name the hidden effect, set it, check the falling error; refusals, cancelling, the end."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import ROOT
from helpers.live_nodes import FAST, Source, drive, newest, ready
from helpers.ros_tools import World, needs_ros, new_domain
from helpers.simulated import recorded

from xy_sysid.cli import run
from xy_sysid.files.package_files import find
from xy_sysid.live.plain_messages import ArrayMessage
from xy_sysid.samples.block import Block
from xy_sysid.samples.recording import Recording

pytestmark = needs_ros
DIAGNOSER, EXCITATION, MACHINE, RECORDER = "xy_sysid.nodes.diagnoser", "xy_sysid.nodes.excitation", "xy_sim.node", "xy_sysid.nodes.recorder"


def trigger(world: World, name: str, seconds: float = 60.0, times: int = 1) -> tuple[bool, str]:
    from std_srvs.srv import Trigger

    answer = world.call(Trigger, f"/xy/diagnoser/{name}", Trigger.Request(), seconds, times)
    return bool(answer.success), str(answer.message)


class Results:
    """The newest message of each latched topic."""

    def __init__(self, world: World) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from std_msgs.msg import Float64MultiArray, String

        from xy_sysid.nodes.common import LATCHED_QOS
        from xy_sysid.nodes.convert import array_from_ros

        self.ladders: dict[str, list[ArrayMessage]] = {"x": [], "y": []}
        self.stories: dict[str, list[str]] = {"x": [], "y": []}
        self.diagnosis: list[Any] = []
        node = world.node
        for axis in ("x", "y"):
            node.create_subscription(
                Float64MultiArray, f"error_ladder/{axis}", lambda m, a=axis: self.ladders[a].append(array_from_ros("", m)), LATCHED_QOS
            )
            node.create_subscription(String, f"story/{axis}", lambda m, a=axis: self.stories[a].append(m.data), LATCHED_QOS)
        node.create_subscription(DiagnosticArray, "diagnosis", lambda m: self.diagnosis.extend(m.status), LATCHED_QOS)

    def held_out(self, axis: str) -> list[float]:
        message = self.ladders[axis][-1]
        assert message.labels == ("step", "step,train_error,held_out_error,noise_floor")
        return [float(value) for value in message.data.reshape(message.sizes)[:, 2]]


def test_hidden_friction_is_named_set_and_gone_and_the_bag_tells_the_same(world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """diagnose answers with the verdict; effects.x adds it and error_ladder/x falls to the floor; replay gives the same document."""
    machine = yaml.safe_load(find("rigid.yaml", "config/machines").read_text(encoding="utf-8"))
    machine["axes"]["x"]["parts"]["coulomb_friction"] = {}
    (tmp_path / "hidden.yaml").write_text(yaml.safe_dump(machine), encoding="utf-8")
    statuses, bag = world.statuses(), tmp_path / "bag"
    world.start(MACHINE, {"machine": str(tmp_path / "hidden.yaml")})
    node = world.start(DIAGNOSER)
    recorder = world.start(RECORDER, {"output": str(bag), "topics": '["voltage", "position"]'})
    world.start(EXCITATION, {**FAST, "duration": 14.0})
    ready(world, statuses, "diagnoser", "ballscrew", "excitation")
    drive(world, statuses, listeners=3)
    results = Results(world)
    ok, text = trigger(world, "diagnose")
    assert ok, node.output()
    assert "axis x: Missing: coulomb_friction. It explains " in text and "axis y: Nothing is missing" in text
    assert world.until(lambda: bool(results.stories["x"]), 5.0)
    assert len(results.held_out("x")) == 1
    assert world.set_parameter("diagnoser", "effects.x", ["coulomb_friction"]) == (True, "")
    assert world.until(lambda: len(results.held_out("x")) == 2, 30.0), node.output()
    before, after = results.held_out("x")
    assert after < 0.2 * before
    assert world.until(lambda: newest(results.diagnosis, "progress")["progress"] == "idle", 10.0)
    told = newest(results.diagnosis, "axis x")
    assert (told["verdict"], told["effect"], told["explained"], told["level"]) == ("missing_effect", "coulomb_friction", "true", "0")
    assert float(told["coulomb_friction.coulomb (V)"]) == pytest.approx(0.2, rel=0.01)
    assert "coulomb_friction" in told["candidate 1"]
    late = Results(world)
    assert world.until(lambda: all((late.stories["x"], late.ladders["y"], late.diagnosis)), 10.0), "latched for who comes late"
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0
    live = json.loads(results.stories["x"][-1])
    assert [row["added"] for row in live["ladder"]] == [None, "coulomb_friction"]
    assert run(["replay", str(bag), "--diagnose", "--json"]) == 0
    replayed = json.loads(capsys.readouterr().out)["stories"]["x"]
    assert {**replayed, "note": ""} == {**live, "note": ""}
    node.send(signal.SIGINT)
    assert node.wait() == 0 and "Traceback" not in node.output()


@cache
def friction() -> Recording:
    return recorded("x:coulomb_friction", seconds=20.0, axes=("x", "y"))


class Sender:
    """Publishes a recording, block by block."""

    def __init__(self, world: World, recording: Recording) -> None:
        from std_msgs.msg import Float64MultiArray

        from xy_sysid.nodes.common import DATA_QOS

        self.world, self.recording = world, recording
        self.publishers = {kind: world.node.create_publisher(Float64MultiArray, kind, DATA_QOS) for kind in ("voltage", "position")}
        assert world.until(lambda: all(p.get_subscription_count() > 0 for p in self.publishers.values()), 30.0)

    def send(self, first: int, last: int) -> None:
        from xy_sysid.nodes.convert import to_message

        recording = self.recording
        for start in range(first, last, 200):
            rows = slice(start, min(start + 200, last))
            seq = np.arange(rows.start, rows.stop, dtype=float)
            for kind, values in (("voltage", recording.voltage), ("position", recording.position)):
                self.publishers[kind].publish(to_message(Block(recording.axes, seq, seq / 2000.0, values[rows])))
            self.world.spin(0.001)


def test_what_lacks_is_said_and_the_model_waits_for_data(world: World) -> None:
    """No data, too few data, an effect set before there are data, a wrong name, cancelling, with data received all the time."""
    results, statuses = Results(world), world.statuses()
    node = world.start(DIAGNOSER)
    sender = Sender(world, friction())
    ok, text = trigger(world, "diagnose", 10.0, times=3)
    assert not ok and "no voltage and no position of axes x, y received yet" in text
    sender.send(0, 6000)
    assert world.until(lambda: float(newest(statuses, "diagnoser").get("seconds kept (s)", "0")) >= 2.99, 10.0)
    ok, text = trigger(world, "auto", 10.0)
    assert not ok and "3 s without a gap, 10 s are needed" in text
    assert newest(results.diagnosis, "axis x")["verdict"] == "not_enough_data"
    ok, why = world.set_parameter("diagnoser", "effects.x", ["coulomb_fricton"])
    assert not ok and "Did you mean 'coulomb_friction'?" in why and "cogging" in why and "\n" not in why
    ok, why = world.set_parameter("diagnoser", "effects.x", ["time_delay"])
    assert not ok and "part of every model" in why
    assert world.set_parameter("diagnoser", "effects.x", ["coulomb_friction"])[0]
    sender.send(6000, 30_000)
    assert world.until(lambda: float(newest(statuses, "diagnoser").get("seconds kept (s)", "0")) >= 14.99, 10.0)
    from std_srvs.srv import Trigger

    waiting = world.node.create_client(Trigger, "/xy/diagnoser/auto").call_async(Trigger.Request())
    assert world.until(lambda: newest(results.diagnosis, "progress")["progress"].startswith("axis x: "), 10.0)
    sender.send(30_000, 40_000)
    assert not waiting.done(), "the service answers when the work is done"
    assert world.until(lambda: float(newest(statuses, "diagnoser")["samples paired"]) == 40_000, 5.0), "data are heard while it works"
    ok, text = trigger(world, "cancel", 10.0)
    assert ok and text.startswith("cancelled axis x")
    assert world.until(waiting.done, 10.0) and waiting.result().message == "cancelled" and not waiting.result().success
    assert world.set_parameter("diagnoser", "effects.x", ["coulomb_friction"])[0]
    assert world.until(lambda: bool(results.ladders["x"]) and len(results.held_out("x")) == 2, 60.0), node.output()
    assert results.held_out("x")[1] < 0.2 * results.held_out("x")[0]
    ok, text = trigger(world, "reset_model", 10.0)
    assert ok and world.until(lambda: len(results.held_out("x")) == 1, 20.0)
    world.node.create_client(Trigger, "/xy/diagnoser/diagnose").call_async(Trigger.Request())
    assert world.until(lambda: "searching" in newest(results.diagnosis, "progress")["progress"], 20.0)
    node.send(signal.SIGINT)
    assert node.wait() == 0
    assert "Traceback" not in node.output()


def test_a_resonance_is_found_alone_then_by_steps_after_a_reset(world: World) -> None:
    """auto adds it; add_next continues from a model with it; after reset_model both find the same again, from the rigid model."""
    results, statuses = Results(world), world.statuses()
    node = world.start(DIAGNOSER)
    Sender(world, recorded("x:base_resonance+x:coulomb_friction", seconds=12.0, axes=("x", "y"))).send(0, 24_000)
    assert world.until(lambda: float(newest(statuses, "diagnoser").get("samples paired", "0")) == 24_000, 20.0)

    def ladder() -> list[str | None]:
        world.until(lambda: newest(results.diagnosis, "progress")["progress"] == "idle", 10.0)
        return [row["added"] for row in json.loads(results.stories["x"][-1])["ladder"]]

    def asked(act: str) -> str:
        ok, text = trigger(world, f"{act}/x", 240.0)
        assert ok, (text, node.output())
        return text

    asked("auto")
    found = ladder()
    errors = results.held_out("x")
    assert found[0] is None and set(found[1:]) == {"base_resonance", "coulomb_friction"} and errors[-1] < 0.2 * errors[0]
    assert "Nothing is left to explain" in asked("add_next")
    assert ladder() == found
    asked("reset_model")
    assert world.until(lambda: len(results.held_out("x")) == 1, 20.0) and ladder() == [None]
    asked("add_next")
    assert ladder() == found[:2]
    asked("add_next")
    assert ladder() == found and results.held_out("x") == pytest.approx(errors, rel=1e-6)
    asked("reset_model")
    assert world.set_parameter("diagnoser", "effects.x", ["base_resonance"]) == (True, "")
    assert world.until(lambda: len(results.held_out("x")) == 2, 60.0) and ladder() == [None, "base_resonance"]
    asked("add_next")
    assert ladder() == [None, "base_resonance", "coulomb_friction"]
    node.send(signal.SIGINT)
    assert node.wait() == 0 and "Traceback" not in node.output()


def test_joint_states_and_an_effect_of_ones_own(world: World, tmp_path: Path) -> None:
    """Joints by name, effort as input, parameters effects.<joint>, and a file with an effect that is not in the library."""
    from sensor_msgs.msg import JointState

    own = tmp_path / "mains_hum.py"
    guide = (ROOT / "docs" / "your-own-effect.md").read_text(encoding="utf-8")
    own.write_text(re.findall(r"```python\n(.*?)```", guide, re.DOTALL)[0], encoding="utf-8")
    axes, results = ("y", "x"), Results(world)
    statuses = world.statuses()
    settings = {"axes": json.dumps(axes), "source": "joint_state", "effort_as_voltage": True, "effect_files": json.dumps([str(own)])}
    node = world.start(DIAGNOSER, {**settings, "effects.x": '["mains_hum"]'})
    source = Source(world, axes, rate=125.0)
    publisher = world.node.create_publisher(JointState, "joint_states", 10_000)
    assert world.until(lambda: publisher.get_subscription_count() > 0, 30.0), node.output()
    for n in range(2500):
        message = JointState(name=["x", "y"], position=source.y[n, ::-1].tolist(), effort=source.u[n, ::-1].tolist())
        stamp = 5.0 + n / 125.0
        message.header.stamp.sec, message.header.stamp.nanosec = int(stamp), round((stamp % 1) * 1e9)
        publisher.publish(message)
        if n % 100 == 0:
            world.spin(0.005)
    assert world.until(lambda: float(newest(statuses, "diagnoser").get("seconds kept (s)", "0")) >= 19.9, 20.0)
    ok, text = trigger(world, "diagnose")
    assert ok and "axis y: Nothing is missing" in text, node.output()
    assert world.until(lambda: len(results.held_out("x")) == 2, 5.0)
    assert json.loads(results.stories["x"][-1])["ladder"][1]["added"] == "mains_hum"


@pytest.mark.parametrize(("arguments", "words"), [
    (["-p", "memry:=3.0"], "Did you mean 'memory'?"),
    (["-p", 'effects.x:=["coging"]'], "Did you mean 'cogging'?"),
    (["-p", 'effects.z:=["cogging"]'], "effects.y"),
])  # fmt: skip
def test_wrong_parameters_end_in_one_line(arguments: list[str], words: str, tmp_path: Path) -> None:
    """Exit code 2, one line, no traceback."""
    environment = {**os.environ, "ROS_DOMAIN_ID": str(new_domain()), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", DIAGNOSER, "--ros-args", *arguments], capture_output=True, text=True, timeout=60, env=environment, cwd=tmp_path
    )
    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
