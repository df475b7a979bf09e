"""ROS conventions of a node: quality of service, diagnostics with its name, descriptors, namespaces, remapped topics, a clock."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from helpers.busy import allowed
from helpers.cli_tools import bare
from helpers.live_nodes import FAST, Source, newest, ready
from helpers.ros_tools import Integrator, World, needs_ros

from xy_sysid.errors import BadInput
from xy_sysid.files.ros_parameters import NODES
from xy_sysid.samples.block import Block
from xy_sysid.settings import build, knobs

pytestmark = needs_ros

EXCITATION, IDENTIFIER, DIAGNOSER = (f"xy_sysid.nodes.{name}" for name in ("excitation", "identifier", "diagnoser"))
BALLSCREW = "xy_sim.node"
QUICK: dict[str, Any] = {"length": 512, "refit": 2.0, "reorder": 0.2, "numerator_order": 0, "denominator_order": 2}


def test_qos_overrides_of_publishers_are_obeyed(world: World) -> None:
    """Metrics latched by a parameter reach late subscribers, up to the depth; the graph shows the same."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    topic = "qos_overrides./xy/metrics.publisher"
    node = world.start(IDENTIFIER, {**QUICK, f"{topic}.durability": "transient_local", f"{topic}.depth": 2})
    first = world.statuses()
    assert world.until(lambda: len([one for one in first if one.name == "streams"]) >= 4, 40.0), node.output()
    (offer,) = world.node.get_publishers_info_by_topic("/xy/metrics")
    assert offer.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    late: list[Any] = []
    quality = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
    known = world.node.get_clock().now()
    world.node.create_subscription(DiagnosticArray, "metrics", late.append, quality)
    assert world.until(lambda: len(late) > 2)
    old = [one for one in late if one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec < 1e-9 * known.nanoseconds]
    assert len(old) == 2


def test_qos_overrides_of_subscriptions_are_obeyed_and_not_overruled(world: World) -> None:
    """A user can select best effort, although the publisher offers more."""
    from rclpy.qos import ReliabilityPolicy
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS

    world.node.create_publisher(Float64MultiArray, "position", DATA_QOS)
    world.node.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
    world.start(IDENTIFIER, {**QUICK, "qos_overrides./xy/position.subscription.reliability": "best_effort"})
    statuses = world.statuses()
    assert world.until(lambda: bool(newest(statuses, "streams")), 40.0)
    heard = {topic: world.node.get_subscriptions_info_by_topic(f"/xy/{topic}") for topic in ("position", "voltage")}
    found = {topic: {item.qos_profile.reliability for item in items} for topic, items in heard.items()}
    assert found == {"position": {ReliabilityPolicy.BEST_EFFORT}, "voltage": {ReliabilityPolicy.RELIABLE}}


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("voltage.publisher.reliability", "loudly", "reliable, best_effort"),
        ("voltage.publisher.depth", "0", "1 to 1000000"),
        ("position.subscription.colour", "red", "history, depth, reliability, durability"),
    ],
)
def test_a_wrong_override_is_one_line(name: str, value: str, words: str) -> None:
    """Name, value, allowed values; exit code 2."""
    command = [sys.executable, "-m", EXCITATION, "--ros-args", "-p", f"qos_overrides./xy/{name}:={value}"]
    said = subprocess.run(command, capture_output=True, text=True, env=bare(), timeout=60, check=False, cwd=ROOT)
    lines = [line for line in said.stderr.splitlines() if "bringing up" not in line]
    assert said.returncode == 2 and len(lines) == 1 and name in lines[0] and words in lines[0], said.stderr


def test_two_tables_in_two_namespaces_are_told_apart(world: World) -> None:
    """Each is driven only by its own excitation, and on /diagnostics each name and hardware id appears once."""
    from diagnostic_msgs.msg import DiagnosticArray

    heard: dict[str, Any] = {}

    def on(message: Any) -> None:
        heard.update({one.name: one for one in message.status})

    def streams(space: str) -> int:
        return int(next(pair.value for pair in heard[f"{space}/identifier: streams"].values if pair.key == "samples paired"))

    world.node.create_subscription(DiagnosticArray, "/diagnostics", on, 100)
    for space in ("/left", "/right"):
        where = ["-r", f"__ns:={space}"]
        world.start(BALLSCREW, {"machine": "rigid.yaml"}, arguments=where)
        world.start(IDENTIFIER, QUICK, arguments=where)
    names = {f"{space}/{name}" for space in ("left", "right") for name in ("ballscrew", "identifier: streams")}
    assert world.until(lambda: names <= set(heard), 60.0), sorted(heard)
    world.start(EXCITATION, {**FAST, "autostart": True}, arguments=["-r", "__ns:=/left"])
    names |= {"left/excitation", "left/identifier: axis x"}
    assert world.until(lambda: names <= set(heard) and streams("left") > 0, 60.0), sorted(heard)
    assert {one.hardware_id for one in heard.values()} == {"left", "right"}
    assert all(one.level in (b"\x00", b"\x01", b"\x02") for one in heard.values())  # STALE is reserved for the aggregator
    assert streams("right") == 0


def test_topics_that_are_remapped_go_on_working(world: World) -> None:
    """As by SetRemap of a launch file: every node with other topic names, with the same effect."""
    names = ["-r", "voltage:=drive/u", "-r", "position:=drive/y", "-r", "metrics:=told"]
    statuses = world.statuses("told")
    world.start(BALLSCREW, {"machine": "rigid.yaml"}, arguments=names)
    world.start(IDENTIFIER, QUICK, arguments=names)
    ready(world, statuses, "ballscrew", "streams")  # connected with this subscriber, which would miss the fits of a quick signal
    world.start(EXCITATION, {**FAST, "autostart": True, "renamed": True}, arguments=names)
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) > 20, 60.0)
    assert float(newest(statuses, "axis x")["relative error (1)"]) < 0.05
    assert world.node.count_publishers("/xy/voltage") == 0


def test_two_robots_with_joints_in_any_script_are_told_apart(world: World) -> None:
    """Each robot in its own namespace, with a joint name without Latin letters: identified under the axis's name, each from its own data."""
    from sensor_msgs.msg import JointState

    joints = {"/left": "关节-2", "/right": "Шарнир Ä"}
    statuses = {space: world.statuses(f"{space}/metrics") for space in joints}
    publishers = {space: world.node.create_publisher(JointState, f"{space}/joint_states", 10_000) for space in joints}
    hears = {**QUICK, "axes": '["größe"]', "source": "joint_state", "effort_as_voltage": True, "length": 256, "band_high": 60.0}
    for space, joint in joints.items():
        world.start(IDENTIFIER, {**hears, "joints": json.dumps([f"größe={joint}"])}, arguments=["-r", f"__ns:={space}"])
    source = Source(world, ("größe",), rate=125.0)
    assert world.until(lambda: all(publisher.get_subscription_count() > 0 for publisher in publishers.values()), 30.0)
    for n in range(4000):
        for number, (space, joint) in enumerate(joints.items(), start=1):
            message = JointState(name=["gripper", joint], position=[0.0, source.y[n, 0]], effort=[0.0, number * source.u[n, 0]])
            message.header.stamp.sec, message.header.stamp.nanosec = 5 + n // 125, n % 125 * 8_000_000
            publishers[space].publish(message)
        if n % 100 == 0:
            world.spin(0.01)

    def gains() -> list[float]:
        return [float(newest(heard, "axis größe").get("gain (m/s/V)", "nan")) for heard in statuses.values()]

    assert world.until(lambda: gains()[0] == pytest.approx(0.1, rel=0.05) and gains()[1] == pytest.approx(0.05, rel=0.05), 60.0), gains()


def test_the_name_of_a_joint_cannot_steer_the_terminal_of_a_node(world: World) -> None:
    """The log shows a name from the network visibly, character by character."""
    from sensor_msgs.msg import JointState

    node = world.start(IDENTIFIER, {**QUICK, "source": "joint_state", "effort_as_voltage": True})
    publisher = world.node.create_publisher(JointState, "joint_states", 10)

    def told() -> bool:
        publisher.publish(JointState(name=["arm\x1b]0;mine\x07\x9b2J"], position=[0.0], effort=[0.0]))
        return "expected x, y" in node.output()

    assert world.until(told, 40.0), node.output()
    assert "joints arm␛]0;mine␇�2J" in node.output() and "\x1b]0" not in node.output()


def test_with_use_sim_time_samples_are_stamped_by_the_clock_topic(world: World) -> None:
    """Real processes: the excitation's samples and the identifier's diagnostics use the time of /clock, and continue while it runs."""
    from builtin_interfaces.msg import Time
    from rosgraph_msgs.msg import Clock

    begun = 5000
    clock = world.node.create_publisher(Clock, "/clock", 10)
    now = [0]

    def tick() -> None:
        now[0] += 20
        clock.publish(Clock(clock=Time(sec=begun + now[0] // 1000, nanosec=now[0] % 1000 * 1_000_000)))

    world.node.create_timer(0.02, tick)
    world.machine(Integrator())
    blocks, statuses = world.blocks(), world.statuses()
    world.start(IDENTIFIER, {**QUICK, "reorder": 2.0, "use_sim_time": True})  # blocks of a busy computer are late
    assert world.until(lambda: bool(newest(statuses, "streams")), 30.0)
    world.start(EXCITATION, {"use_sim_time": True, "autostart": True, "duration": 8.0, "watchdog": 5.0})
    assert world.until(lambda: newest(statuses, "excitation").get("state") == "stopped", 60.0)
    assert begun < blocks[0].time[0] < begun + now[0] / 1000
    assert world.until(lambda: int(newest(statuses, "streams").get("samples paired", "0")) > 4000), newest(statuses, "streams")


def test_descriptors_say_what_may_be_set(world: World) -> None:
    """Choices as additional constraints, numbers with ranges, and fixed parameters of a running node as read-only."""
    from rcl_interfaces.srv import DescribeParameters

    world.start(IDENTIFIER, QUICK)
    world.start(EXCITATION)
    names = {
        "identifier": ["source", "window", "overlap", "axes", "input_unit", "refit"],
        "excitation": ["x.kind", "x.rms", "output", "rate", "axes", "watchdog"],
    }
    found: dict[str, Any] = {}
    for node, asked in names.items():
        answer = world.call(DescribeParameters, f"/xy/{node}/describe_parameters", DescribeParameters.Request(names=asked), times=3)
        found |= {f"{node} {item.name}": item for item in answer.descriptors}
    assert found["identifier source"].additional_constraints == "one of blocks, joint_state" and found["identifier source"].read_only
    assert found["identifier input_unit"].read_only and found["identifier axes"].read_only and found["excitation axes"].read_only
    assert found["excitation output"].read_only and "one of blocks, commands" in found["excitation output"].additional_constraints
    assert "multisine" in found["excitation x.kind"].additional_constraints and not found["excitation x.kind"].read_only
    assert found["excitation x.rms"].floating_point_range[0].to_value == 100.0
    for node, name in (("excitation", "watchdog"), ("identifier", "refit")):  # 0 is refused, and outside of the range
        assert found[f"{node} {name}"].floating_point_range[0].from_value > 0.0 and found[f"{node} {name}"].additional_constraints == "above 0"
        assert not world.set_parameter(node, name, 0.0)[0] and world.set_parameter(node, name, 0.002) == (True, "")
    assert found["identifier overlap"].floating_point_range and all(item.description for item in found.values())


def test_a_lifecycle_manager_takes_it_through_all_states_and_back(world: World) -> None:
    """As by nav2's manager, without a bond: configure, activate, deactivate, cleanup, again, then shutdown."""
    world.machine(Integrator())
    process = world.start(EXCITATION)
    for _ in range(2):
        assert [world.transition("excitation", label) for label in ("configure", "activate", "deactivate", "cleanup")] == [True] * 4
    assert world.state("excitation") == "unconfigured"
    assert world.transition("excitation", "shutdown")
    assert "Traceback" not in process.output()


@pytest.mark.parametrize("module", [EXCITATION, IDENTIFIER, DIAGNOSER, BALLSCREW])
def test_every_node_says_when_it_is_ready(world: World, module: str) -> None:
    """One line after everything is compiled and subscribed, for which a launch file can wait."""
    node = world.start(module)
    assert world.until(lambda: "]: ready" in node.output(), 60.0), node.output()
    assert world.until(lambda: world.node.count_publishers("/xy/metrics") == 1)


def test_an_excitation_that_starts_by_itself_waits_for_the_machine_however_long_it_takes(world: World) -> None:
    """A present machine that is silent for longer than patience does not end the drive: it starts again until the machine answers."""
    machine = Integrator()
    machine.alive = False
    world.machine(machine)
    statuses, blocks = world.statuses(), world.blocks()
    node = world.start(EXCITATION, {"autostart": True, "patience": 0.5, "duration": 1.0})
    assert world.until(lambda: node.output().count("starts again") >= 1, 40.0), node.output()
    assert not any(block.values.any() for block in blocks)
    machine.alive = True
    assert world.until(lambda: any(block.values.any() for block in blocks), 20.0), node.output()
    assert world.until(lambda: newest(statuses, "excitation").get("reason", "").startswith("the duration")), newest(statuses, "excitation")


def test_joints_of_another_publisher_are_no_warning_and_a_fault_that_is_over_clears(world: World) -> None:
    """A gripper's joint states on the same topic keep the level OK; a message without numbers is a WARN for 10 s only."""
    import time

    from rclpy.duration import Duration
    from sensor_msgs.msg import JointState

    topic = world.node.create_publisher(JointState, "joint_states", 50)
    statuses = world.statuses()
    world.start(IDENTIFIER, {**QUICK, "axes": '["pan"]', "source": "joint_state", "effort_as_voltage": True})
    assert world.until(lambda: topic.get_subscription_count() == 1, 40.0)
    sent, first = [0], world.node.get_clock().now()

    def publish(names: list[str], values: list[float]) -> None:
        message = JointState(name=names, position=values, effort=values)
        message.header.stamp = (first + Duration(nanoseconds=sent[0] * 20_000_000)).to_msg()  # evenly spaced, for any load of the computer
        topic.publish(message)

    def tick() -> None:
        sent[0] += 1
        publish(["pan"], [0.001 * (sent[0] % 7)])
        publish(["finger"], [0.5])

    def levels() -> list[int]:
        return [status.level[0] for status in statuses if status.name == "streams"]

    world.node.create_timer(0.02, tick)
    assert world.until(lambda: levels()[-3:] == [0, 0, 0], 20.0), [one.message for one in statuses]
    assert int(newest(statuses, "streams")["messages refused"]) == 0
    publish(["pan"], [])  # without numbers
    assert world.until(lambda: levels()[-1] == 1, 5.0)
    begun = time.monotonic()
    assert world.until(lambda: levels()[-1] == 0, 20.0), [one.message for one in statuses][-3:]
    assert time.monotonic() - begun < allowed(10.0) and int(newest(statuses, "streams")["messages refused"]) == 1


def test_a_simulated_machine_that_missed_some_voltage_says_so_for_ten_seconds(world: World) -> None:
    """A gap in the counter of the voltage is a WARN for at most 10 s; the count remains."""
    import time

    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import to_message

    topic = world.node.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
    statuses = world.statuses()
    world.start(BALLSCREW, {"machine": "rigid.yaml"})
    assert world.until(lambda: topic.get_subscription_count() == 1, 40.0)
    sent = [0]

    def tick() -> None:
        seq = np.arange(sent[0], sent[0] + 20, dtype=np.float64)
        topic.publish(to_message(Block(("x", "y"), seq, 1e9 + seq / 2000.0, np.zeros((20, 2)))))
        sent[0] += 20

    def levels() -> list[int]:
        return [status.level[0] for status in statuses if status.name == "ballscrew"]

    world.node.create_timer(0.02, tick)
    assert world.until(lambda: levels()[-3:] == [0, 0, 0], 20.0)
    sent[0] += 100
    assert world.until(lambda: levels()[-1] == 1, 5.0)
    begun = time.monotonic()
    assert world.until(lambda: levels()[-1] == 0, 20.0), [one.message for one in statuses][-3:]
    assert time.monotonic() - begun < allowed(10.0) and newest(statuses, "ballscrew")["voltage lost"] == "1"


@pytest.mark.parametrize("node", NODES)
def test_no_range_of_a_descriptor_has_an_end_that_is_refused(node: str) -> None:
    """Both ends of the range of every number of every node are accepted, except for conflicts with other settings."""
    from xy_sysid.nodes.common import describe

    refused = {}
    for item in knobs(NODES[node]()):
        descriptor = describe(item)
        ends = [end for one in (*descriptor.floating_point_range, *descriptor.integer_range) for end in (one.from_value, one.to_value)]
        for end in ends:
            try:
                build(NODES[node], {item.name: end})
            except BadInput as problem:
                if re.search(r"allowed: [<>]", str(problem)):
                    refused[item.name] = str(problem)
    assert refused == {}
