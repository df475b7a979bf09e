"""Node identifier over real DDS: identification, bit-for-bit replay, memory over a kill, parameters, bad streams, joints."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from helpers.live_nodes import FAST, Source, drive, newest, ready
from helpers.ros_tools import World, needs_ros, new_domain

from xy_sysid.bags import Bag, BagWriter, stream_blocks
from xy_sysid.bags.sums import check_sums
from xy_sysid.imports import load
from xy_sysid.live.plain_messages import ArrayMessage
from xy_sysid.live.replay import replay
from xy_sysid.samples.block import Block
from xy_sysid.settings import IdentifierSettings

pytestmark = needs_ros
IDENTIFIER, EXCITATION, MACHINE, RECORDER = "xy_sysid.nodes.identifier", "xy_sysid.nodes.excitation", "xy_sim.node", "xy_sysid.nodes.recorder"


def arrays(world: World, topics: list[str]) -> dict[str, list[ArrayMessage]]:
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import LATCHED_QOS
    from xy_sysid.nodes.convert import array_from_ros

    heard: dict[str, list[ArrayMessage]] = {topic: [] for topic in topics}
    for topic in topics:
        quality: Any = LATCHED_QOS if topic.startswith("transfer") else 10

        def take(message: Float64MultiArray, topic: str = topic) -> None:
            heard[topic].append(array_from_ros(topic, message))

        world.node.create_subscription(Float64MultiArray, topic, take, quality)
    return heard


def test_live_recorded_and_replayed_are_the_same_bit_for_bit(world: World, tmp_path: Path) -> None:
    """Machine, excitation, identifier and recorder as processes; a replay of the bag gives every published array."""
    statuses = world.statuses()
    bag = tmp_path / "bag"
    recorder = world.start(RECORDER, {"output": str(bag), "storage": "mcap"})
    world.start(MACHINE)
    world.start(IDENTIFIER)
    world.start(EXCITATION, {**FAST, "duration": 16.0})
    ready(world, statuses, "streams", "ballscrew", "excitation")
    assert world.until(lambda: all(f"recording /xy/{topic}" in recorder.output() for topic in ("voltage", "position", "frf/x", "comparison/y")), 20.0)
    drive(world, statuses, listeners=3)
    assert world.until(lambda: int(newest(statuses, "axis x").get("fit", "0")) >= 8, 30.0)
    world.spin(1.5)
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0
    topics = [f"{kind}/{axis}" for kind in ("frf", "transfer_function", "comparison") for axis in ("x", "y")]
    topics += ["cross_frf/x_from_y", "cross_frf/y_from_x", "coupling/x_and_y"]
    live: dict[str, list[bytes]] = {topic: [] for topic in topics}
    for topic, data in recorded_arrays(bag, topics):
        live[topic].append(data)
    again: dict[str, list[bytes]] = {topic: [] for topic in topics}
    blocks = ((kind, block) for kind, block in stream_blocks(bag) if kind != "reference")
    for update in replay(blocks, IdentifierSettings(), ("x", "y")):
        for message in update.arrays():
            again[message.topic].append(message.data.tobytes())
    assert len(live["frf/x"]) >= 8
    for topic in topics:
        assert live[topic] == again[topic], topic
    status = newest(statuses, "axis x")
    assert float(status["relative error (1)"]) < 0.015
    assert float(status["delay (s)"]) == pytest.approx(1.29e-3, abs=20e-6)
    assert newest(statuses, "streams")["skipped fits"] == "0"
    assert len(load(bag)) >= 32_000


def recorded_arrays(bag: Path, topics: list[str]) -> Iterator[tuple[str, bytes]]:
    """Read with rosbags, which also proves that the bag is valid."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, raw in reader.messages([c for c in reader.connections if c.topic.removeprefix("/xy/") in topics]):
            message: Any = reader.deserialize(raw, connection.msgtype)
            yield connection.topic.removeprefix("/xy/"), np.asarray(message.data).tobytes()


QUICK: dict[str, Any] = {"length": 1024, "numerator_order": 0, "denominator_order": 2, "refit": 1.0}


def test_a_killed_identifier_goes_on_with_its_spectra(world: World, tmp_path: Path) -> None:
    """kill -9 and restart: the earlier windows are still counted and the fit continues."""
    statuses = world.statuses()
    state = tmp_path / "state.npz"
    settings = {**QUICK, "state_file": str(state), "save_every": 0.5}
    source = Source(world)
    first = world.start(IDENTIFIER, settings)
    assert world.until(source.found, 30.0)
    source.send(0, 40_000)
    assert world.until(lambda: int(newest(statuses, "streams").get("windows x", "0")) >= 70, 20.0)
    world.spin(1.2)
    before = int(newest(statuses, "streams")["windows x"])
    first.send(signal.SIGKILL)
    first.wait()
    statuses.clear()
    second = world.start(IDENTIFIER, settings)
    assert world.until(lambda: int(newest(statuses, "streams").get("windows x", "0")) == before, 30.0), second.output()
    assert world.until(source.found, 30.0)
    source.send(40_000, 60_000)
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) >= before + 30, 20.0)
    assert "loaded" in second.output()


def test_a_state_that_does_not_fit_is_kept_aside_in_words(world: World, tmp_path: Path) -> None:
    """It is neither used nor lost: the node says so and starts without it."""
    statuses = world.statuses()
    state = tmp_path / "state.npz"
    state.write_bytes(b"not a state")
    node = world.start(IDENTIFIER, {**QUICK, "state_file": str(state)})
    ready(world, statuses, "streams")
    assert (tmp_path / "state.npz.unusable").read_bytes() == b"not a state"
    assert "is no state of the identifier" in node.output()
    assert "Traceback" not in node.output()


def test_parameters_change_while_it_runs_and_wrong_ones_are_refused(world: World) -> None:
    """Orders change at once, the window with a new start, limits give a sentence; services reset, save and load answer."""
    from std_srvs.srv import Trigger

    statuses = world.statuses()
    source = Source(world)
    world.start(IDENTIFIER, QUICK)
    assert world.until(source.found, 30.0)
    source.send(0, 20_000)
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) >= 30, 20.0)
    assert world.set_parameter("identifier", "denominator_order", 3) == (True, "")
    source.send(20_000, 30_000)
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) >= 50, 20.0)
    ok, why = world.set_parameter("identifier", "overlap", 2.0)
    assert not ok and why
    ok, why = world.set_parameter("identifier", "band_low", 400.0)
    assert not ok and "allowed: below band_high = 300.0 Hz" in why
    ok, why = world.set_parameter("identifier", "state_file", "x")
    assert not ok and "not to be changed while the node runs" in why
    assert world.set_parameter("identifier", "length", 512)[0]
    statuses.clear()
    source.send(30_000, 36_000)
    assert world.until(lambda: 0 < int(newest(statuses, "axis x").get("windows", "0")) < 30, 20.0)
    answer = world.call(Trigger, "/xy/identifier/reset", Trigger.Request())
    assert answer.success
    answer = world.call(Trigger, "/xy/identifier/save", Trigger.Request())
    assert not answer.success and "state_file" in answer.message


def test_bad_messages_are_refused_in_words_and_nothing_crashes(world: World) -> None:
    """Wrong columns, wrong sizes, NaN, a restart of the source: counted and reported, and identification continues."""
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension

    from xy_sysid.nodes.convert import to_message

    statuses = world.statuses()
    source = Source(world)
    node = world.start(IDENTIFIER, QUICK)
    assert world.until(source.found, 30.0)
    source.send(0, 10_000)
    broken = Float64MultiArray(data=[1.0, 2.0, 3.0])
    broken.layout.dim = [MultiArrayDimension(label="sample", size=2, stride=8), MultiArrayDimension(label="seq,time,x,y", size=4, stride=4)]
    source.publishers["position"].publish(broken)
    source.publishers["position"].publish(Float64MultiArray())
    seq = np.arange(10_000.0, 10_020.0)
    source.publishers["position"].publish(to_message(Block(("a", "b"), seq, seq / 2000, np.zeros((20, 2)))))
    source.publishers["voltage"].publish(to_message(Block(("x", "y"), seq, seq / 2000, np.full((20, 2), np.nan))))
    source.send(10_020, 20_000)
    source.send(20_000, 40_000, shift=20_000)
    assert world.until(lambda: int(newest(statuses, "axis x").get("windows", "0")) >= 60, 20.0)
    assert world.until(lambda: "stream: restart" in newest(statuses, "streams"), 5.0)
    streams, axis = newest(statuses, "streams"), newest(statuses, "axis x")
    assert int(streams["messages refused"]) == 2
    assert int(streams["stream: restart"]) >= 1
    assert int(axis["dropped windows"]) >= 2
    assert float(axis["relative error (1)"]) < 0.05
    assert "Traceback" not in node.output()


@pytest.mark.parametrize("reliability", ["RELIABLE", "BEST_EFFORT"])
def test_joint_states_are_paired_by_stamp_with_effort_as_input(world: World, reliability: str) -> None:
    """JointState with one sample per message is identified like blocks, for any reliability of its publisher."""
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState

    quality = QoSProfile(depth=10_000, reliability=ReliabilityPolicy[reliability])
    statuses = world.statuses()
    axes = ("shoulder", "elbow")
    node = world.start(
        IDENTIFIER,
        {**QUICK, "axes": json.dumps(axes), "source": "joint_state", "effort_as_voltage": True, "length": 256, "band_high": 60.0, "refit": 10.0},
    )
    source = Source(world, axes, rate=125.0)
    publisher = world.node.create_publisher(JointState, "joint_states", quality)
    wanted: list[int] = []
    assert world.until(lambda: publisher.get_subscription_count() > 0, 30.0)
    for n in range(4000):
        message = JointState(name=["elbow", "shoulder"], position=source.y[n, ::-1].tolist(), effort=source.u[n, ::-1].tolist())
        stamp = 5.0 + n / 125.0
        message.header.stamp.sec, message.header.stamp.nanosec = int(stamp), round((stamp % 1) * 1e9)
        publisher.publish(message)
        if n % 100 == 0:
            world.spin(0.005)
        if n % 500 == 499:  # the reader keeps up, so that best effort loses nothing on a busy computer either
            wanted.append(n - 500)
            world.until(lambda: int(newest(statuses, "streams").get("samples paired", "0")) > wanted[-1], 10.0)
    assert world.until(lambda: int(newest(statuses, "axis elbow").get("windows", "0")) >= 25, 60.0), node.output()
    assert float(newest(statuses, "axis elbow")["sampling rate (Hz)"]) == pytest.approx(125.0)
    assert float(newest(statuses, "axis elbow")["relative error (1)"]) < 0.05
    assert "effort is taken as V and position as m; set input_unit" in node.output()


def test_joint_states_in_ros_time_are_paired_with_the_voltage_of_the_excitation(world: World) -> None:
    """One clock: blocks of one row, joints of any spelling mapped to axes; a driver with another clock is reported and never OK."""
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import from_message, to_message

    statuses, place, late = world.statuses(), np.zeros(2), [1000.0]
    publisher = world.node.create_publisher(JointState, "joint_states", 1000)
    position = world.node.create_publisher(Float64MultiArray, "position", DATA_QOS)
    stamps: list[float] = []
    sent: list[tuple[int, float]] = []

    def play(message: Any) -> None:
        block = from_message(message)
        sent.extend(zip(block.seq.tolist(), block.time.tolist(), strict=True))
        for row in range(len(block)):
            stamps.append(time.time() - float(block.time[row]))
            place[:] += block.values[row] * 1e-3
            stamp = float(block.time[row]) + 3e-4 - late[0]
            joints = JointState(name=["joint-2", "left/wrist", "base"], position=[place[1], 0.0, place[0]])
            joints.header.stamp.sec, joints.header.stamp.nanosec = int(stamp), int((stamp % 1) * 1e9)
            publisher.publish(joints)
            position.publish(to_message(Block(block.axes, block.seq[row : row + 1], block.time[row : row + 1], place[None, :])))

    world.node.create_subscription(Float64MultiArray, "voltage", play, DATA_QOS)
    joints = json.dumps(["x=base", "y=joint-2"])
    world.start(IDENTIFIER, {**QUICK, "source": "joint_state", "joints": joints, "length": 64, "band_high": 40.0, "refit": 60.0})
    world.start(EXCITATION, {"rate": 100.0, "block": 1, "watchdog": 5.0, "x.high": 40.0, "y.high": 40.0})
    ready(world, statuses, "streams", "excitation")
    assert world.until(lambda: int(newest(statuses, "excitation").get("listeners", "0")) >= 2 and publisher.get_subscription_count() > 0, 20.0)
    assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
    assert world.until(lambda: "apart by 1000" in newest(statuses, "streams").get("message", ""), 20.0), newest(statuses, "streams")
    assert newest(statuses, "streams")["level"] == "2" and newest(statuses, "streams")["samples paired"] == "0"
    late[0] = 0.0
    assert world.until(lambda: int(newest(statuses, "streams")["samples paired"]) > 500, 20.0), newest(statuses, "streams")

    def rate_is_known() -> bool:
        """The rate is that of the excitation's clock, up to the effect of its stalls on the slope of a line through 5 s."""
        counted, times = np.array(sent).T
        slips = float(np.ptp(times - counted / 100.0))
        return float(newest(statuses, "streams")["sampling rate (Hz)"]) == pytest.approx(100.0, rel=1e-6 + 3.0 * slips / 5.0)

    assert world.until(rate_is_known, 20.0), newest(statuses, "streams")
    assert abs(np.median(stamps)) < 60.0, "not ROS time"
    assert world.transition("excitation", "deactivate")


@pytest.mark.parametrize("module", [IDENTIFIER, "xy_sysid.nodes.diagnoser"])
def test_axes_of_any_spelling_start_and_alike_ones_are_refused_in_a_line(world: World, module: str) -> None:
    """joint-2 is an axis; joint-2 beside joint_2 would share a topic."""
    statuses = world.statuses()
    world.start(module, {"axes": json.dumps(["joint-2", "left/wrist"])})
    ready(world, statuses, "streams" if module == IDENTIFIER else "diagnoser")
    refused = world.start(module, {"axes": json.dumps(["joint-2", "joint_2"])})
    assert refused.wait(30.0) == 2
    assert "parameter axes" in refused.output() and "Traceback" not in refused.output()


def test_silence_is_said(world: World) -> None:
    """Without any stream the node names the missing ones."""
    statuses = world.statuses()
    world.start(IDENTIFIER, QUICK)
    assert world.until(lambda: "no voltage and no position received" in newest(statuses, "streams").get("message", ""), 30.0)


def test_a_recorder_killed_in_the_middle_leaves_a_readable_bag(world: World, tmp_path: Path) -> None:
    """kill -9: all data older than two seconds are there."""
    recorder = world.start(RECORDER, {"output": str(tmp_path / "bag")})
    source = Source(world)
    assert world.until(source.found, 30.0)
    source.send(0, 20_000)
    world.spin(2.5)
    recorder.send(signal.SIGKILL)
    recorder.wait()
    assert len(load(tmp_path / "bag")) == 20_000
    assert check_sums(tmp_path / "bag") == "good"


@pytest.mark.parametrize(("module", "arguments", "words"), [
    (IDENTIFIER, ["-p", "lenght:=512"], "length"),
    (IDENTIFIER, ["-p", "overlap:=2.0"], "overlap"),
    (MACHINE, ["-p", "machine:=papre.yaml"], "paper"),
    (RECORDER, ["-p", "storage:=tape"], "sqlite3"),
])  # fmt: skip
def test_wrong_parameters_end_in_one_line(module: str, arguments: list[str], words: str, tmp_path: Path) -> None:
    """Exit code 2, one line, no traceback."""
    environment = {**os.environ, "ROS_DOMAIN_ID": str(new_domain()), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-m", module, "--ros-args", *arguments], capture_output=True, text=True, timeout=60, env=environment, cwd=tmp_path
    )
    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_unpaired_reference(tmp_path: Path) -> None:
    """A bag written block by block is read unchanged."""
    with BagWriter(tmp_path / "bag") as writer:
        for start in range(0, 400, 20):
            seq = np.arange(start, start + 20, dtype=float)
            for topic, values in (("/xy/voltage", np.sin(seq)), ("/xy/position", seq)):
                writer.write_block(topic, Block(("x",), seq, seq / 100, values[:, None]), int(start * 1e7))
    with Bag(tmp_path / "bag") as bag:
        assert bag.kind("/xy/voltage") == "std_msgs/msg/Float64MultiArray"
    assert np.array_equal(load(tmp_path / "bag").position[:, 0], np.arange(400.0))
