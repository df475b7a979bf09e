"""Real processes over DDS: reaction of the machine to an excitation that is killed, doubled, or without a clock."""

from __future__ import annotations

import json
import signal
import time
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from helpers.browser_tools import Server
from helpers.busy import allowed
from helpers.ros_tools import Integrator, World, needs_ros

from xy_sysid.samples.block import Block, FloatArray

pytestmark = needs_ros
EXCITATION, MACHINE = "xy_sysid.nodes.excitation", "xy_sim.node"
PUSH = {"x.kind": '"off"', "x.offset": 1.0, "x.centring": 0.0, "y.kind": '"off"', "y.centring": 0.0, "ramp": 0.05, "watchdog": 1.0}


def activate(world: World, node: str = "excitation") -> None:
    assert world.transition(node, "configure")
    assert world.transition(node, "activate")


@pytest.mark.parametrize("watchdog", [0.05, 0.0])
def test_kill_9_of_the_excitation_is_what_the_drive_makes_of_it(world: World, watchdog: float) -> None:
    """Killed at 1 V: a drive with a watchdog stops the axis within 50 ms and 30 mm; one without runs into the end stop."""
    positions, statuses = world.blocks("position"), world.statuses()
    world.start(MACHINE, {"machine": "rigid.yaml", "realtime": True, "watchdog": watchdog})
    process = world.start(EXCITATION, PUSH)

    def has_two_listeners() -> bool:
        return any(value.key == "listeners" and value.value == "2" for status in statuses for value in status.values)

    def place() -> float:
        return float(positions[-1].values[-1, 0]) if positions else 0.0

    assert world.transition("excitation", "configure") and world.until(has_two_listeners)
    assert world.transition("excitation", "activate")

    assert world.until(lambda: place() > 0.005, 20.0)
    assert place() < 0.1  # the travel limit has not braked yet, so the held voltage is the drive
    process.send(signal.SIGKILL)
    heard, then = len(positions), world.node.get_clock().now().nanoseconds * 1e-9
    if watchdog > 0:
        assert world.until(lambda: any("the drive went to 0 V" in status.message for status in statuses), 3.0)

        def track() -> tuple[FloatArray, FloatArray]:
            """All received times and positions; the newest may be later than the status."""
            return np.concatenate([block.time for block in positions]), np.concatenate([block.values[:, 0] for block in positions])

        def still() -> bool:
            time, where = track()
            return bool(time[-1] > then + 1.0 and np.ptp(where[time > time[-1] - 0.5]) < 1e-4)

        assert world.until(still, 5.0)
        time, where = track()
        killed, moved = float(np.interp(then, time, where)), float(time[np.abs(where - where[-1]) > 1e-4][-1])
        assert moved - then < allowed(0.5)
        assert time[0] < then and place() - killed < 0.03 and place() < 0.14, (time[0], then, time[-1])
    else:
        assert world.until(lambda: place() > 0.149, 5.0)
    seq = np.concatenate([block.seq for block in positions[heard - 1 :]])
    assert seq.size > 100 and (np.diff(seq) == 1).all()  # the encoder continued to report


def test_a_voltage_that_starts_again_is_followed_though_its_first_blocks_were_lost(world: World) -> None:
    """The drive has continued by itself when a source restarts at counter 160: it answers with the new counters."""
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import to_message

    positions = world.blocks("position")
    world.start(MACHINE, {"machine": "rigid.yaml", "realtime": True, "watchdog": 0.05})
    publisher = world.node.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
    assert world.until(lambda: publisher.get_subscription_count() == 1, 20.0)

    def send(first: int) -> None:
        seq = np.arange(first, first + 20, dtype=np.float64)
        publisher.publish(to_message(Block(("x", "y"), seq, time.time() + (seq - first) / 2000.0, np.zeros((20, 2)))))

    send(0)
    assert world.until(lambda: bool(positions) and positions[-1].seq[-1] > 4000.0)
    send(160)
    assert world.until(lambda: any(block.seq[0] == 160.0 for block in positions))
    assert world.until(lambda: 179.0 < positions[-1].seq[-1] < 2000.0)


def test_guards_do_not_sleep_when_the_clock_is_taken_away(world: World) -> None:
    """use_sim_time is set while it drives, without a published clock: voltage continues, and the watchdog still detects a silent machine."""
    blocks, machine = world.blocks(), Integrator()
    world.machine(machine)
    process = world.start(EXCITATION, {"watchdog": 0.5, "ramp": 0.0})
    activate(world)
    assert world.until(lambda: len(blocks) > 10 and bool(blocks[-1].values.any()))
    assert world.set_parameter("excitation", "use_sim_time", True) == (True, "")
    sent = len(blocks)
    assert world.until(lambda: len(blocks) > sent + 20 and bool(blocks[-1].values.any()))
    machine.alive, silent = False, time.monotonic()
    assert world.until(lambda: "no position from the machine for 500 ms" in process.output(), 5.0)
    assert time.monotonic() - silent < allowed(4.0)
    assert world.until(lambda: not blocks[-1].values.any(), 1.0) and world.state("excitation") == "inactive"


def test_two_excitations_never_drive_one_machine(world: World) -> None:
    """A second excitation stops the first, with its name; while both exist, the second cannot configure, nor the first activate."""
    blocks, statuses = world.blocks(), world.statuses()
    world.machine(Integrator())
    first = world.start(EXCITATION, {"watchdog": 2.0, "ramp": 0.0})
    activate(world)
    assert world.until(lambda: len(blocks) > 10 and bool(blocks[-1].values.any()))
    second = world.start(EXCITATION, {"watchdog": 2.0}, arguments=["-r", "__node:=other"])
    assert world.until(lambda: "publishes /xy/voltage, too: two must not drive one machine" in first.output(), 20.0), first.output()
    assert "/xy/other publishes" in first.output() or "whose name is not known yet publishes" in first.output()  # after a stall
    assert world.until(lambda: not blocks[-1].values.any(), 1.0) and world.state("excitation") == "inactive"
    assert not world.transition("other", "configure")
    assert "/xy/excitation publishes /xy/voltage, too: configure is refused while it runs. End one of the two." in second.output()
    assert not world.transition("excitation", "activate")
    assert "/xy/other publishes /xy/voltage, too: activate is refused while it runs" in first.output()
    assert world.until(lambda: any("activate is refused while it runs" in status.message for status in statuses), 2.0)
    assert world.until(lambda: any("configure is refused" in status.message for status in statuses), 2.0)
    second.send(signal.SIGTERM)
    assert second.wait() == 0
    assert world.until(lambda: world.transition("excitation", "activate"), 10.0)
    ended = len(statuses)  # the refusal has no further effect
    assert world.until(lambda: any(status.name == "excitation" and status.level == b"\x00" for status in statuses[ended:]), 10.0)


def test_an_encoder_that_freezes_is_told_and_ends_at_zero_volts(world: World) -> None:
    """Frozen while driven, over DDS: zero volts, inactive, status ERROR with the reason."""
    blocks, statuses, machine = world.blocks(), world.statuses(), Integrator()

    def answer(block: Block) -> Block | None:
        true = machine(block)
        assert true is not None
        frozen = np.tile(true.values[:1] if len(blocks) < 100 else np.array([[0.01, 0.01]]), (len(block), 1))
        return Block(block.axes, block.seq, block.time, true.values if len(blocks) < 100 else frozen)

    world.machine(answer)
    process = world.start(EXCITATION, {**PUSH, "x.offset": 2.0, "watchdog": 10.0})  # this process is the machine, and may be slow
    activate(world)
    assert world.until(lambda: "inactive: x: the position " in process.output(), 20.0), process.output()
    assert world.until(lambda: world.state("excitation") == "inactive", 3.0) and not blocks[-1].values.any()
    assert world.until(lambda: any(status.level == b"\x02" and status.message.startswith("x: the position ") for status in statuses), 3.0)


def test_post_stop_is_answered_from_the_machines_state(world: World, tmp_path: Path) -> None:
    """The page's server: no 'stopped' without confirmation; with an excitation, zero volts and its state."""
    from std_srvs.srv import Trigger

    blocks = world.blocks()
    server = Server(tmp_path, ROS_DOMAIN_ID=str(world.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    try:

        def post() -> dict[str, object]:
            request = urllib.request.Request(f"{server.address}stop", method="POST", headers={"X-Requested-With": "xy_sysid"})
            with urllib.request.urlopen(request, timeout=80.0) as answer:
                found: dict[str, object] = json.load(answer)
                return found

        nobody = post()
        assert nobody["asked"] is True and nobody["stopped"] is False and "emergency stop" in str(nobody["words"])
        world.machine(Integrator())
        process = world.start(EXCITATION, {"watchdog": 2.0, "ramp": 0.0})
        assert world.transition("excitation", "configure")
        assert world.until(lambda: "STOP is on" in process.output(), 10.0)  # still on from before the start of the excitation
        assert not world.transition("excitation", "activate") and "from page_stop" in process.output()
        for done in (False, True):
            assert world.call(Trigger, "/xy/excitation/release_stop", Trigger.Request()).success == done
        assert world.transition("excitation", "activate")
        assert world.until(lambda: len(blocks) > 10 and bool(blocks[-1].values.any()))
        with ThreadPoolExecutor() as pool:
            asked = pool.submit(post)
            assert world.until(asked.done, 20.0)
        assert asked.result()["stopped"] is True and world.state("excitation") == "inactive"
        assert not blocks[-1].values.any()
    finally:
        server.end()
