"""STOP over real DDS: held per publisher, released by it or by an operator, fast for any ramps; and a single excitation."""

from __future__ import annotations

import time
from typing import Any

import pytest
from helpers.busy import allowed
from helpers.ros_tools import Integrator, NodeProcess, World, needs_ros

from xy_sysid.samples.block import Block

pytestmark = needs_ros
EXCITATION = "xy_sysid.nodes.excitation"
QUIET: dict[str, Any] = {"watchdog": 5.0, "ramp": 0.0}
PUBLISHER = """
import sys, rclpy
from std_msgs.msg import Bool
from xy_sysid.nodes.common import LATCHED_QOS
rclpy.init(args=["--ros-args", "-r", "__ns:=/xy"])
node = rclpy.create_node("guard")
topic = node.create_publisher(Bool, "stop", LATCHED_QOS)
topic.publish(Bool(data=True))
rclpy.spin(node)
"""


def driving(world: World, blocks: list[Block]) -> None:
    assert world.until(lambda: len(blocks) > 10 and bool(blocks[-1].values.any()), 20.0)


def release(world: World) -> tuple[bool, str]:
    from std_srvs.srv import Trigger

    answer = world.call(Trigger, "/xy/excitation/release_stop", Trigger.Request())
    return bool(answer.success), str(answer.message)


@pytest.mark.parametrize("latched", [True, False])
def test_stop_is_held_by_each_who_asked_for_it(world: World, latched: bool) -> None:
    """Two publishers: false from one does not release the STOP of the other, latched or not, and the status names the holder."""
    from std_msgs.msg import Bool

    from xy_sysid.nodes.common import LATCHED_QOS

    world.machine(Integrator())
    statuses = world.statuses()
    process = world.start(EXCITATION, QUIET)
    assert world.transition("excitation", "configure")
    quality = LATCHED_QOS if latched else 10
    one, other = (world.node.create_publisher(Bool, "stop", quality) for _ in range(2))
    assert world.until(lambda: min(one.get_subscription_count(), other.get_subscription_count()) >= 1 + latched)
    for _ in range(20):  # a message that is not latched is lost if the subscriber has not discovered its publisher
        one.publish(Bool(data=True))
        if world.until(lambda: "STOP is on (topic stop, from test)" in process.output(), 1.0):
            break
    assert "STOP is on (topic stop, from test)" in process.output()
    other.publish(Bool(data=True))
    other.publish(Bool(data=False))
    held = {"stop": "on", "stop held by": "test"}
    assert world.until(lambda: bool(statuses) and held.items() <= {pair.key: pair.value for pair in statuses[-1].values}.items())
    assert not world.transition("excitation", "activate") and "STOP is released" not in process.output()
    one.publish(Bool(data=False))
    assert world.until(lambda: "STOP is released" in process.output())
    assert world.transition("excitation", "activate")


def test_the_stop_of_one_who_is_gone_is_released_by_an_operator_who_was_told_whose_it_is(world: World) -> None:
    """A process latches true and ends: false from another releases nothing; the service first names it, and overrides it at the second call."""
    from std_msgs.msg import Bool

    from xy_sysid.nodes.common import LATCHED_QOS

    world.machine(Integrator())
    guard = world.start(PUBLISHER)
    process = world.start(EXCITATION, QUIET)
    assert world.transition("excitation", "configure")
    assert world.until(lambda: "STOP is on (topic stop, from guard)" in process.output(), 20.0), process.output()
    guard.end()
    page = world.node.create_publisher(Bool, "stop", LATCHED_QOS)
    page.publish(Bool(data=False))
    assert not world.transition("excitation", "activate")
    first, words = release(world)
    assert not first and "held by guard" in words and not world.transition("excitation", "activate")
    second, words = release(world)
    assert second and "STOP of guard" in words and "is overridden" in words
    assert world.transition("excitation", "activate")


def test_stop_is_quick_whatever_the_ramps_are(world: World) -> None:
    """abort_ramp is set to 10 s while it drives, and a deactivate starts that ramp: STOP still gives zero volts in half a second."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState
    from std_msgs.msg import Bool

    blocks = world.blocks()
    world.machine(Integrator())
    world.start(EXCITATION, QUIET)
    stop = world.node.create_publisher(Bool, "stop", 10)
    for deactivated in (False, True):
        assert not deactivated or world.transition("excitation", "activate")
        if not deactivated:
            assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
        driving(world, blocks)
        assert world.set_parameter("excitation", "abort_ramp", 10.0) == (True, "")
        if deactivated:
            client = world.node.create_client(ChangeState, "/xy/excitation/change_state")
            assert world.until(client.service_is_ready)
            client.call_async(ChangeState.Request(transition=Transition(label="deactivate")))
            world.spin(0.3)
            assert blocks[-1].values.any()
        begun = time.monotonic()
        stop.publish(Bool(data=True))
        assert world.until(lambda: not blocks[-1].values.any(), 1.0)
        assert time.monotonic() - begun < allowed(0.5)
        assert world.until(lambda: world.state("excitation") == "inactive", 3.0)
        stop.publish(Bool(data=False))
        world.spin(0.2)


@pytest.mark.parametrize("latched", [True, False])
def test_a_stop_that_is_released_at_once_stops_nevertheless(world: World, latched: bool) -> None:
    """True and false a moment later, as of a push button: zero volts, inactive, with STOP as the reason; then activate is allowed."""
    from std_msgs.msg import Bool

    from xy_sysid.nodes.common import LATCHED_QOS

    blocks, statuses = world.blocks(), world.statuses()
    world.machine(Integrator())
    world.start(EXCITATION, QUIET)
    stop = world.node.create_publisher(Bool, "stop", LATCHED_QOS if latched else 10)
    assert world.transition("excitation", "configure")
    assert world.until(lambda: stop.get_subscription_count() >= 1 + latched)
    for _ in range(3):
        assert world.transition("excitation", "activate")
        driving(world, blocks)
        stop.publish(Bool(data=True))
        stop.publish(Bool(data=False))
        assert world.until(lambda: world.state("excitation") == "inactive", 3.0) and not blocks[-1].values.any()
        assert world.until(lambda: any(status.message == "STOP" for status in statuses), 3.0)
        statuses.clear()


def alone(process: NodeProcess) -> bool:
    return "configure is refused" in process.output()


def test_two_excitations_of_one_name_never_drive(world: World) -> None:
    """A launch file started twice: neither configures while it sees the other, and no voltage is published; a single one drives."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    blocks = world.blocks()
    world.machine(Integrator())
    both = [world.start(EXCITATION, QUIET) for _ in range(2)]
    assert world.until(lambda: all("ready" in process.output() for process in both), 20.0)
    client = world.node.create_client(ChangeState, "/xy/excitation/change_state")
    for _ in range(20):  # a request reaches those that the client has discovered, and one that has not yet discovered the other configures
        if all(alone(process) for process in both):
            break
        for label in ("cleanup", "configure"):
            client.call_async(ChangeState.Request(transition=Transition(label=label)))
        world.until(lambda: all(alone(process) for process in both), 1.0)
    assert all(alone(process) for process in both), [process.output() for process in both]
    for label in ("cleanup", "configure", "activate"):
        client.call_async(ChangeState.Request(transition=Transition(label=label)))
    world.spin(1.0)
    assert blocks == []
    both[1].process.terminate()
    assert both[1].wait() == 0
    assert world.until(lambda: world.transition("excitation", "configure"), 20.0) and world.transition("excitation", "activate")
    driving(world, blocks)


def test_a_second_one_of_the_same_name_for_another_topic_does_not_drive(world: World) -> None:
    """The first, which drives already, continues. The second is refused as soon as it has discovered the first."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    blocks = world.blocks()
    world.machine(Integrator())
    world.start(EXCITATION, QUIET)
    assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
    driving(world, blocks)
    second = world.start(EXCITATION, QUIET, arguments=["-r", "voltage:=voltage_of_another"])
    client = world.node.create_client(ChangeState, "/xy/excitation/change_state")
    refusal = "another node is called /xy/excitation, too: configure is refused"
    for label in ("configure", "activate") * 10:  # a request reaches those that the client has discovered
        client.call_async(ChangeState.Request(transition=Transition(label=label)))
        if world.until(lambda: refusal in second.output(), 1.0):
            break
    assert refusal in second.output() and "driving" not in second.output()
    sent = len(blocks)
    assert world.until(lambda: len(blocks) > sent + 10 and bool(blocks[-1].values.any()))
