"""Node excitation over real DDS: no motion before activate, zero volts last at any end, lockstep bit for bit."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import bare
from helpers.ros_tools import World, needs_ros

from xy_sysid.excitation.designed import Needs, document_of
from xy_sysid.excitation.drive import Drive
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.samples.block import Block
from xy_sysid.settings import AxisExcitation, ExcitationSettings

MODULE = "xy_sysid.nodes.excitation"
LOCKSTEP: dict[str, Any] = {"lockstep": True, "speed": 0.0, "ramp": 0.05}


class Integrator:
    """A machine whose position is the sum of the voltage, 0.1 m/s/V; silent after ``blocks`` blocks."""

    def __init__(self, blocks: int = 10**9) -> None:
        self.left, self.place = blocks, np.zeros(2)

    def __call__(self, block: Block) -> Block | None:
        self.left -= 1
        if self.left < 0:
            return None
        path = self.place + np.cumsum(block.values, axis=0) * 0.1 / 2000
        self.place = path[-1]
        return Block(block.axes, block.seq, block.time, path)


def activate(world: World) -> None:
    assert world.transition("excitation", "configure")
    assert world.transition("excitation", "activate")


def moving(blocks: list[Block]) -> bool:
    return any(block.values.any() for block in blocks[-2:])


@needs_ros
def test_nothing_before_activate_and_zero_after_deactivate(world: World) -> None:
    """Lifecycle: no block before `activate`; after `deactivate` the last block is zeros; and it can be activated again."""
    blocks = world.blocks()
    world.machine(Integrator())
    process = world.start(MODULE, {"watchdog": 2.0, "ramp": 0.1})
    assert world.transition("excitation", "configure")
    world.spin(0.3)
    assert blocks == [] and world.state("excitation") == "inactive"
    assert world.transition("excitation", "activate")
    assert world.until(lambda: len(blocks) > 30 and moving(blocks))
    assert blocks[0].axes == ("x", "y") and blocks[0].values.shape == (20, 2) and not blocks[0].values.any()
    assert world.transition("excitation", "deactivate")
    world.spin(0.2)
    sent = len(blocks)
    assert not blocks[-1].values.any() and world.state("excitation") == "inactive"
    world.spin(0.3)
    assert len(blocks) == sent
    assert world.transition("excitation", "activate")
    assert world.until(lambda: len(blocks) > sent + 20 and moving(blocks))
    assert blocks[sent].seq[0] > blocks[sent - 1].seq[-1] + 1  # the pause is a gap
    assert "Traceback" not in process.output()


@needs_ros
@pytest.mark.parametrize(("number", "lockstep"), [(signal.SIGINT, False), (signal.SIGTERM, True)])
def test_a_signal_ends_at_zero_volts(world: World, number: signal.Signals, lockstep: bool) -> None:
    """Zero volts is the last published value on Ctrl-C and SIGTERM; the exit is clean, and a second Ctrl-C changes nothing."""
    blocks = world.blocks()
    world.machine(Integrator())
    process = world.start(MODULE, {"watchdog": 2.0, "ramp": 0.2, "lockstep": lockstep})
    activate(world)
    assert world.until(lambda: len(blocks) > 20 and moving(blocks))
    process.send(number)
    world.spin(0.15)
    process.send(signal.SIGINT)
    assert world.until(lambda: process.process.poll() is not None, 40.0)
    world.spin(0.2)
    assert process.wait() == 0
    assert not blocks[-1].values.any()
    fading = np.concatenate([block.values for block in blocks])
    assert np.abs(np.diff(fading[-400:], axis=0)).max() < 1.5  # no step to zero: the noise itself changes by less
    assert "Traceback" not in process.output() and "Error" not in process.output()


@needs_ros
def test_positions_that_stop_trip_the_watchdog(world: World) -> None:
    """Encoder watchdog: ramp to zero, inactive, with the reason in the log and in the metrics."""
    blocks, statuses = world.blocks(), world.statuses()
    world.machine(Integrator(blocks=60))
    process = world.start(MODULE, {"watchdog": 0.3, "ramp": 0.0})
    activate(world)
    assert world.until(lambda: "no position from the machine for 300 ms" in process.output())
    assert world.until(lambda: world.state("excitation") == "inactive", 2)
    assert not blocks[-1].values.any() and moving(blocks[:50])
    assert world.until(lambda: any("no position" in status.message for status in statuses), 2)
    last = statuses[-1]
    assert last.name == "excitation" and last.level == b"\x02"
    assert {"state", "reason", "blocks_late", "x.rms", "y.clipped"} <= {pair.key for pair in last.values}


@needs_ros
def test_a_machine_that_never_answers_is_named(world: World) -> None:
    """If the machine never answers: inactive at 0 V, with the reason."""
    blocks = world.blocks()
    process = world.start(MODULE, {"patience": 0.4, "lockstep": True})
    activate(world)
    assert world.until(lambda: "no answer from the machine for 0.4 s" in process.output())
    assert world.state("excitation") == "inactive"
    assert blocks and not any(block.values.any() for block in blocks)
    process.send(signal.SIGINT)
    assert process.wait() == 0


@needs_ros
def test_a_machine_that_is_found_late_is_asked_again(world: World) -> None:
    """In lockstep, if the first block or its answer is lost, another zero block follows instead of endless silence."""
    blocks = world.blocks()
    world.start(MODULE, {**LOCKSTEP, "patience": 20.0})
    activate(world)
    assert world.until(lambda: len(blocks) > 0)
    world.machine(Integrator())
    assert world.until(lambda: moving(blocks), 10)
    assert world.state("excitation") == "active"


@needs_ros
def test_lockstep_is_bit_for_bit_what_the_drive_makes_of_the_positions(world: World) -> None:
    """Lockstep: block k goes out on the answer to block k - ahead and uses exactly that position; duration ends it."""
    blocks, machine = world.blocks(), Integrator()
    world.machine(machine)
    process = world.start(MODULE, {**LOCKSTEP, "ahead": 2, "duration": 3.0, "autostart": True, "x.centring": 5.0})
    assert world.until(lambda: "the duration of 3 s is over" in process.output(), 20)
    world.spin(0.2)
    axes = {"x": AxisExcitation(seed=1, centring=5.0), "y": AxisExcitation(seed=2)}
    drive = Drive(ExcitationSettings(axes=axes, lockstep=True, speed=0.0, ramp=0.05, ahead=2, duration=3.0))
    drive.start()
    twin = Integrator()
    answers: list[Block] = []
    expected: list[Block] = []
    while drive.state != "stopped":
        if len(answers) >= 2:
            drive.see(answers[-2])
        expected.append(drive.next(20))
        answer = twin(expected[-1])
        assert answer is not None
        answers.append(answer)
    assert len(blocks) == len(expected) > 300
    begun = blocks[0].time[0]
    assert abs(time.time() - begun) < 60.0, "not ROS time"
    for mine, heard in zip(expected, blocks, strict=True):
        assert np.array_equal(mine.seq, heard.seq) and np.array_equal(mine.values, heard.values)
        assert np.allclose(heard.time - begun, mine.time, rtol=0.0, atol=1e-6)
    assert not blocks[-1].values.any()


@needs_ros
@pytest.mark.parametrize("where", ["Drive.tick", "Drive.next"])
def test_an_error_of_its_own_ends_at_zero_volts(world: World, where: str) -> None:
    """Zero volts is the last published value after an error, even one in the computation of the voltage; the error is reported."""
    blocks = world.blocks()
    world.machine(Integrator())
    code = f"""
import sys, itertools
from xy_sysid.excitation.drive import Drive
from xy_sysid.experiment_design.experiment import Experiment
count, honest = itertools.count(), {where}
def failing(self, argument):
    if next(count) > 60:
        raise RuntimeError("a bug")
    return honest(self, argument)
{where} = failing
from xy_sysid.nodes.excitation import main
sys.exit(main())
"""
    process = world.start(code, {**LOCKSTEP, "speed": 1.0, "autostart": True})
    assert world.until(lambda: process.process.poll() is not None, 40.0)
    world.spin(0.3)
    assert process.wait() == 1 and "RuntimeError: a bug" in process.output()
    assert any(block.values.any() for block in blocks) and not blocks[-1].values.any()


@needs_ros
def test_a_transition_that_is_not_allowed_is_refused_and_ends_nothing(world: World) -> None:
    """configure (1), cleanup (2) and other transitions that an active node does not have, by number: refused, and it continues to drive."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    blocks = world.blocks()
    world.machine(Integrator())
    node = world.start(MODULE, {"watchdog": 2.0, "ramp": 0.0})
    activate(world)
    assert world.until(lambda: len(blocks) > 10 and moving(blocks))

    def goes_on(sent: int) -> bool:
        return len(blocks) > sent + 10 and moving(blocks)

    for number in (1, 2, 5, 99):
        answer = world.call(ChangeState, "/xy/excitation/change_state", ChangeState.Request(transition=Transition(id=number)))
        assert not answer.success, number
        assert world.until(functools.partial(goes_on, len(blocks))) and world.state("excitation") == "active", number
    assert "could not be handled" in node.output() and "Traceback" not in node.output()


@needs_ros
def test_real_time_is_kept_without_drift(world: World) -> None:
    """Block k is due at t0 + k * block / rate: two seconds are 200 blocks, in order and without gaps."""
    blocks = world.blocks()
    world.machine(Integrator())
    world.start(MODULE, {"watchdog": 2.0, "autostart": True})
    assert world.until(lambda: len(blocks) >= 50, 40.0)
    before, began = blocks[-1].seq[-1], time.monotonic()
    world.spin(2.0)
    due = 100.0 * (time.monotonic() - began)
    seq = np.concatenate([block.seq for block in blocks])
    assert due - 10 <= (seq[-1] - before) / 20 <= due + 10  # also of lost blocks
    lost = (seq[-1] - seq[0] + 1) / 20 - len(blocks)
    assert (np.diff(seq) > 0).all() and lost < 100


@needs_ros
def test_parameters_change_live_or_are_refused_with_a_sentence(world: World) -> None:
    """rms and limits change live; other settings only while inactive; limits and spelling are checked."""
    blocks = world.blocks()
    world.machine(Integrator())
    process = world.start(MODULE, {**LOCKSTEP, "speed": 1.0, "ahead": 1})
    assert world.set_parameter("excitation", "x.kind", "multisine") == (True, "")
    activate(world)
    assert world.until(lambda: len(blocks) > 20 and moving(blocks))
    assert world.set_parameter("excitation", "y.rms", 0.0) == (True, "")
    world.spin(0.2)
    assert not blocks[-1].values[:, 1].any() or np.abs(blocks[-1].values[:, 1]).max() < 0.05  # centring only
    for name, value, words in (
        ("x.kind", "noise", "Deactivate first"),
        ("x.rms", -1.0, ""),
        ("x.kind", "noyse", "noise"),
        ("rate", 500.0, "Deactivate"),
    ):
        changed, reason = world.set_parameter("excitation", name, value)
        assert not changed and words in reason and reason and "\n" not in reason
    assert "Traceback" not in process.output()


@needs_ros
@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("x.rmss", 1.0, "Did you mean 'x.rms'?"),
        ("x.rms", -1.0, "x.rms is -1.0"),
        ("axes", "x", 'list of names like ["x", "y"]'),
        ("x.rms", "{", "Couldn't parse"),
    ],
)
def test_a_wrong_parameter_is_one_line_and_exit_code_2(world: World, name: str, value: object, words: str) -> None:
    """Unknown names give the nearest spelling, wrong values the allowed range; no traceback."""
    process = world.start(MODULE, {name: value})
    assert process.wait() == 2
    lines = [line for line in process.output().splitlines() if "[rcl]" not in line]
    assert len(lines) == 1 and words in lines[0]


@needs_ros
def test_axes_can_be_named_and_a_signal_that_does_not_fit_is_refused(world: World) -> None:
    """Axes come from the parameter `axes`; configure fails with a sentence if a signal does not fit the rate."""
    blocks = world.blocks()
    process = world.start(MODULE, {"axes": '["a"]', "a.high": 900, "rate": 1000.0})
    assert not world.transition("excitation", "configure")
    assert "below half the rate, 500 Hz" in process.output()
    assert world.set_parameter("excitation", "a.high", 400.0) == (True, "")
    activate(world)
    assert world.until(lambda: len(blocks) > 2)
    assert blocks[0].axes == ("a",) and not any(block.values.any() for block in blocks)
    process.send(signal.SIGTERM)
    assert process.wait() == 0


@needs_ros
def test_broken_positions_do_not_crash_it(world: World) -> None:
    """NaN, wrong columns and wrong sizes do not count as positions."""
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import to_message

    publisher = world.node.create_publisher(Float64MultiArray, "position", DATA_QOS)
    process = world.start(MODULE, {"patience": 1.0})
    blocks = world.blocks()
    activate(world)
    one = np.array([5.0])
    broken = [
        Float64MultiArray(),
        to_message(Block(("x", "q"), one, one, np.zeros((1, 2)))),
        to_message(Block(("x", "y"), one, one, np.array([[np.nan, 0]]))),
    ]
    broken.append(to_message(Block(("x", "y"), one * np.nan, one, np.array([[0.0, 0]]))))
    for _ in range(5):
        for message in broken:
            publisher.publish(message)
        world.spin(0.1)
    assert world.until(lambda: "no answer from the machine" in process.output(), 5)
    assert "not usable" in process.output() and "layout.dim" in process.output() and "Traceback" not in process.output()
    assert blocks and not any(block.values.any() for block in blocks)


def test_without_ros_it_says_in_one_line_what_to_install() -> None:
    """The extra [ros] installs the wheels; without it a node says in one line what to install."""
    code = "import sys; sys.modules['rclpy'] = None; from xy_sysid.nodes.excitation import main; sys.exit(main())"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.splitlines() == ["ROS 2 (rclpy) is not installed. Install it with: pip install 'xy_sysid[ros]'"]


@needs_ros
def test_what_drives_is_there_at_once() -> None:
    """The driving node and the starter need no compiler; the receiving nodes need no scipy.signal (half a second)."""
    modules = {"nodes.excitation_node": {"numba", "scipy.signal"}, "processes.starter": {"numba", "scipy"}, "live.identifier": {"scipy.signal"}}
    for module, heavy in modules.items():
        code = f"import sys, xy_sysid.{module}; print(*sorted({heavy!r} & set(sys.modules)))"
        done = subprocess.run([sys.executable, "-c", code], env=bare(), capture_output=True, text=True, check=True)
        assert done.stdout == "\n", module


@needs_ros
def test_a_designed_experiment_is_loaded_and_one_beyond_the_limits_is_refused(world: World, tmp_path: Path) -> None:
    """Parameter experiment: configure checks the file against the node's limits; if refused, it cannot be activated."""
    loud, good = (tmp_path / name for name in ("loud.yaml", "good.yaml"))
    slow = AxisExcitation(kind="off", rms=0.0, slow=2.0, slow_period=3.0)
    for place, volts in ((loud, 12.0), (good, 2.0)):
        place.write_text(
            yaml.safe_dump(document_of("x", 2000.0, Experiment(slow, 12.0), Needs(volts, (-0.05, 0.05), 0.0, (-0.04, 0.04), (-0.14, 0.14), 0.1, 1.0)))
        )
    process = world.start(MODULE, {"experiment": str(loud)})
    assert not world.transition("excitation", "configure")
    assert world.until(lambda: "loud.yaml: voltage of axis x is 12 V" in process.output())
    assert world.set_parameter("excitation", "experiment", str(good)) == (True, "")
    assert world.transition("excitation", "configure")
    assert world.set_parameter("excitation", "x.limit", 5.0)[0]
