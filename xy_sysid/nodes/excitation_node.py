"""Lifecycle node that drives the axes: publishes ``voltage``, reads ``position``; or commands a controller and reads joint states.

Nothing moves before ``activate``. After every end (deactivate, a guard, an error, Ctrl-C, SIGTERM) the last published voltage is
zero, and the node ends after it was acknowledged. Pacing, guards and signals are pure logic in other modules.
"""

from __future__ import annotations

import math
import re
import threading
import time
from pathlib import Path

import numpy as np
from rclpy.clock import Clock as RosClock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.timer import Timer
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput
from xy_sysid.excitation.designed import Planned
from xy_sysid.excitation.drive import Drive
from xy_sysid.excitation.pacing import CATCH_UP, Answers, Clock
from xy_sysid.excitation.trajectory_drive import TrajectoryDrive, drive_of
from xy_sysid.files.experiment import read_experiment
from xy_sysid.live.recent import Recent
from xy_sysid.live.status_values import INPUT_UNIT, OUTPUT_UNIT
from xy_sysid.nodes.axes import AXES, declare_axes
from xy_sysid.nodes.commands import Beat, Commands
from xy_sysid.nodes.common import DATA_QOS, NAMESPACE, declare
from xy_sysid.nodes.convert import from_message, status, to_message
from xy_sysid.nodes.diagnostics import Diagnostics
from xy_sysid.nodes.hearing import Ear
from xy_sysid.nodes.quality import Overridable
from xy_sysid.nodes.stop_topic import StopTopic
from xy_sysid.nodes.trajectories import Trajectories
from xy_sysid.nodes.wall import Wall
from xy_sysid.processes.terminal import printable
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import ExcitationSettings, for_axes, knobs

ARRIVES = Duration(seconds=1.0)  # longest wait for the acknowledgement of the last zero
SAME_EPOCH = 0.05  # s by which the ROS time of counter 0 may change in a pause before the stamps follow it
SETTLED = 0.5  # s without a new subscriber before the automatic start, so that nodes started together receive the first sample
SAME_NODE = 2.0  # s to wait for one node that reads voltage and writes position; then two nodes suffice
ALONE = 0.1  # s between two checks for another node that drives
KNOCK = 1.0  # s after which zeros are sent again in lockstep while no machine has answered
STOP_LOOK = 0.02  # s between two checks of STOP
FOUND = 1.0  # s after which a node has discovered all nodes that existed before it
INTRODUCES = 0.5  # s after which the name of a discovered node is known
KILLED = "A node that was killed is forgotten after 20 s."

FIXED = ("output", "interface", "command", "unit", "command_topic", "controller_joints", "joint_topic", "joints")  # set when the node starts
LAST = 5  # repetitions of the last command: a controller subscribes with best effort
FOLLOW = 0.01  # fraction by which the stamp of each command is corrected towards the ROS clock, so that the clocks do not drift apart
FOLLOW_MOTION = 0.0001  # the same for trajectories, whose motion follows the stamps


class ExcitationNode(Overridable, LifecycleNode):
    """The adapter: time, topics, parameters and lifecycle around a Drive."""

    exit_code: int | None = None

    def __init__(self) -> None:
        super().__init__("excitation", namespace=NAMESPACE, automatically_declare_parameters_from_overrides=True)
        axes = declare_axes(self)
        if any("." in axis for axis in axes):
            raise BadInput(f"node excitation: parameter {AXES}", list(axes), "names without a dot", "Give joints short names.")
        self._knobs = declare(self, for_axes(ExcitationSettings, axes), self._accept, also=[AXES], fixed=FIXED)
        self._drive: Drive | None = None
        self._planned = Planned()
        self._pacer = Clock(0.0, 0.0)
        self._answers = Answers()
        self._blocks = 0  # sent since activation
        self._first = 0  # counter of the first sample since activation
        self._epoch: float | None = None  # s, ROS time of the sample with counter 0
        self._until: float | None = None  # s, steady time at which the last sent block ends
        self._loud = False  # the last published block was not all zeros
        self._complaint = ""
        self._stop_on = False  # at the last look
        self._stop_told = ""  # the last logged sentence on STOP
        self._unnamed = 0.0  # s for which another publisher has been present without a name
        self._refused = ""  # why the last transition was refused
        self._refusals, self._recent = 0, Recent()
        self._made = time.monotonic()
        self._wall = Wall(self._complain)
        for service in self._services:  # rclpy's own: a transition that is not possible in this state would end the node
            service.callback = self._wall.around(service.callback)
        self._steady = RosClock(clock_type=ClockType.STEADY_TIME)  # guards must not sleep when the clock is stopped or set
        self._voltage = self.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
        self._metrics = Diagnostics(self)
        self._reference = self.create_publisher(Float64MultiArray, "reference", DATA_QOS) if self._knobs.settings.interface != "effort" else None
        self._hold = threading.RLock()  # of the drive, if a separate thread sends commands
        self._beat: Beat | None = None
        self._rows: list[tuple[float, float, FloatArray]] = []  # seq, time and values of commands not yet published as a block
        commanding = {"forward": Commands, "joint_trajectory": Trajectories}[self._knobs.settings.command]
        on_commands = self._knobs.settings.output == "commands"
        self._commands = commanding(self, self._knobs.settings, self._on_joints, self._complain) if on_commands else None
        self._position = self._commands.states if self._commands else Ear(self, Float64MultiArray, "position", self._on_position, DATA_QOS)
        self._stop = StopTopic(self, self._wall)
        self.create_timer(STOP_LOOK, self._hear_stop, clock=self._steady)
        self._pace: Timer | None = None
        self.create_timer(0.5, self._report, clock=self._steady)
        self.create_timer(ALONE, self._look_for_another, clock=self._steady)
        self._autostart: Timer | None = None
        self._waiting_since, self._readers, self._settled_at = 0.0, 0, 0.0  # readers of the voltage, and when their number is settled
        if self._knobs.settings.autostart:
            self._wait_for_machine()
        self.get_logger().info(
            "unconfigured: nothing moves before configure and activate" + (", which come by themselves" if self._autostart else "")
        )

    # lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check that every signal fits the rate, and that no other node drives the machine."""
        time.sleep(max(0.0, self._made + FOUND - time.monotonic()))
        rivals = self._rivals()
        if rivals:
            return self._refuse(f"{rivals}: configure is refused while it runs. End one of the two. {KILLED}")
        try:
            self._planned = self._take_experiment()
            seq = 0 if self._drive is None else self._drive.seq  # the counter never goes back
            self._drive = drive_of(self._knobs.settings, seq, self._planned)
        except BadInput as error:
            return self._refuse(str(error))
        if isinstance(self._drive, TrajectoryDrive):
            self.get_logger().info(self._drive.sizes)
        return super().on_configure(state)

    def _take_experiment(self) -> Planned:
        """Set the parameters from the file of a designed experiment, and return its plan. Raises BadInput if it exceeds the node's limits."""
        settings = self._knobs.settings
        if not settings.experiment:
            return Planned()
        (wanted, planned), before = read_experiment(settings, Path(settings.experiment)), {item.name: item.value for item in knobs(settings)}
        new = [Parameter(item.name, value=item.value) for item in knobs(wanted) if item.value != before[item.name]]
        answer = self.set_parameters_atomically(new)
        if not answer.successful:
            raise BadInput(settings.experiment, "an experiment", "one that the parameters allow", answer.reason)
        return planned

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin, at 0 V until the first position; refused while STOP is on."""
        self._obey_stop()
        if self._stop.held:
            return self._refuse(self._stop.why())
        others = self._others()
        if others:
            return self._refuse(f"{' and '.join(others)} publishes {self._way}, too: activate is refused while it runs. {KILLED}")
        strange = self._no_commands(self._commands) if self._commands else self._no_blocks()
        if strange:
            return self._refuse(strange)
        settings, now = self._knobs.settings, time.monotonic()
        if self._drive is not None and self._until is not None:
            self._first = self._drive.seq
            if not settings.lockstep:  # a pause is a gap in the counter
                self._first += max(1, math.ceil((now - self._until) * settings.rate * settings.speed))
        try:
            self._drive = drive_of(settings, self._first, self._planned)
        except BadInput as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        period = settings.step / settings.rate / settings.speed if settings.speed > 0 else 0.0
        epoch = self.get_clock().now().nanoseconds * 1e-9 - self._first / settings.rate
        if self._epoch is None or (not settings.lockstep and abs(epoch - self._epoch) > SAME_EPOCH):
            self._epoch = epoch
        self._pacer, self._answers, self._blocks = Clock(period, now), Answers(self._first - 1), 0
        self._drive.start()
        wake = min(0.01, settings.watchdog / 4, period / 2 if period > 0 else 0.01)
        if self._commands is not None:
            self._commands.forget()
            self._rows.clear()
            self._beat = Beat(period, self._on_beat)
            self._pacer = self._beat.clock
        self._pace = self.create_timer(max(wake, 0.001), self._on_time, clock=self._steady)
        return super().on_activate(state)

    def _refuse(self, why: str) -> TransitionCallbackReturn:
        """Report why a transition is refused, in the log and for some seconds in the status."""
        self._refused, self._refusals = why, self._refusals + 1
        self.get_logger().error(why)
        self._report()
        return TransitionCallbackReturn.FAILURE

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fade out now, then zero."""
        self._finish("deactivated")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Nothing to release."""
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fade out now, then zero."""
        self._finish("shut down")
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Zero, whatever went wrong."""
        self.last_words()
        return super().on_error(state)

    # STOP

    def _hear_stop(self) -> None:
        """STOP: zero volts and inactive now, and no activate until it is released."""
        if self._obey_stop() and self._drive is not None and self._pace is not None:
            self.trigger_deactivate()
            self._report()

    def _obey_stop(self) -> bool:
        """Read the topic STOP, and begin to fade out if it is on or was on since the last call; returns whether it was."""
        before = self._stop_on
        wanted = self._stop.listen() or self._stop.held
        self._stop_on = self._stop.held
        if wanted and self._drive is not None and not self.has_stopped():
            with self._hold:
                self._drive.obey_stop()
        if before and not self._stop_on:
            self.get_logger().warning("STOP is released: activate is allowed again")
        if before != self._stop_on:
            self._report()
        return wanted

    # another excitation

    @property
    def _way(self) -> str:
        """The topic on which the machine is driven."""
        return str(self._commands.publisher.topic_name if self._commands else self._voltage.topic_name)

    def _no_blocks(self) -> str:
        """Why no blocks may be sent: a controller would read their counter as an effort. Empty if they may be sent."""
        topic = self._way
        if self._knobs.settings.renamed:
            return ""
        if topic.rpartition("/")[2] != "voltage":
            return (
                f"blocks of voltage would go to {topic}, where a controller would take their counter for a command: activate is refused. "
                "Set output to commands for a controller, or renamed to true if blocks are expected there."
            )
        infos = self.get_subscriptions_info_by_topic(topic)
        strange = sorted(
            {info.node_name for info in infos if info.topic_type != "std_msgs/msg/Float64MultiArray" or re.search("controller", info.node_name)}
        )
        if strange:
            return (
                f"{' and '.join(strange)} subscribes to {topic} and does not expect blocks of voltage: activate is refused. "
                "Set output to commands for a controller, or renamed to true if blocks are expected there."
            )
        return ""

    def _no_commands(self, commands: Commands) -> str:
        """Why no trajectories may be sent: no node receives them. Empty if one does, or for a forward controller."""
        if not isinstance(commands, Trajectories):
            return ""
        kinds = {info.topic_type for info in self.get_subscriptions_info_by_topic(self._way)}
        if "trajectory_msgs/msg/JointTrajectory" in kinds:
            return ""
        there = f"its subscribers expect {', '.join(sorted(kinds))}" if kinds else "no node subscribes to it"
        return (
            f"trajectories would go to {self._way}, and {there}: activate is refused. Start the JointTrajectoryController, "
            "and set command_topic to its topic, /NAME_OF_CONTROLLER/joint_trajectory."
        )

    def _others(self) -> list[str]:
        """Names of the other nodes that drive the machine."""
        topic = self._way
        if self.count_publishers(topic) <= 1:
            return []
        names = [f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in self.get_publishers_info_by_topic(topic)]
        me = self.get_fully_qualified_name()
        if me in names:
            names.remove(me)  # once: another one may have the same name
        return sorted(set(names))

    def _rivals(self) -> str:
        """A sentence on another node that drives the machine or has this node's name; empty if there is none."""
        others = self._others()
        if others:
            return f"{' and '.join(others)} publishes {self._way}, too"
        me = self.get_fully_qualified_name()
        names = [f"{space.rstrip('/')}/{name}" for name, space in self.get_node_names_and_namespaces()]
        return f"another node is called {me}, too" if names.count(me) > 1 else ""

    def _look_for_another(self) -> None:
        drive = self._drive
        if drive is None or drive.state != "active":
            return
        others = self._others()
        unnamed = any("UNKNOWN" in name for name in others)
        self._unnamed = self._unnamed + ALONE if unnamed else 0.0
        if others and not 0 < self._unnamed < INTRODUCES:
            drive.fault = True
            who = " and ".join("a node whose name is not known yet" if "UNKNOWN" in name else name for name in others)
            drive.stop(f"{who} publishes {self._way}, too: two must not drive one machine", drive.settings.abort_ramp)
            self.get_logger().error(drive.reason)
            self.trigger_deactivate()

    # the end of the process

    def ask_to_stop(self, reason: str) -> None:
        """Fade out in order while positions are still read."""
        if self._drive is not None:
            with self._hold:
                self._drive.stop(reason, self._drive.settings.ramp)

    def has_stopped(self) -> bool:
        """True if the last published block is zeros."""
        return self._drive is None or self._drive.state in ("idle", "stopped")

    def last_words(self) -> None:
        """Zero volts, even if the drive itself has failed."""
        try:
            self._finish("ended")
        finally:
            if self._loud and self._drive is not None and self._commands is None:
                block = self._drive.zeros(self._drive.settings.block)
                self._publish(block)
                self._voltage.wait_for_all_acked(ARRIVES)

    def destroy_node(self) -> None:
        """As rclpy's."""
        self._stop.close()
        super().destroy_node()

    def _finish(self, reason: str) -> None:
        """Fade out without waiting for positions, in real time unless in lockstep, and wait until the zeros are acknowledged."""
        if self._pace is not None:
            self.destroy_timer(self._pace)
            self._pace = None
        drive = self._drive
        if drive is None:
            return
        if self._beat is not None:
            self._finish_commands(drive, self._beat, reason)
            return
        was_running = drive.state in ("active", "stopping")
        drive.stop(reason, drive.settings.abort_ramp)
        while drive.state == "stopping":
            self._obey_stop()
            self._send(drive)
            time.sleep(0.0 if drive.settings.lockstep else self._pacer.period)
        self._report()  # the end is reported before the acknowledgements
        if was_running or self._loud:
            self._voltage.wait_for_all_acked(ARRIVES)

    def _finish_commands(self, drive: Drive, beat: Beat, reason: str) -> None:
        """Wait while the thread fades out; then send the safe output several times, and wait until it is acknowledged."""
        assert self._commands is not None
        with self._hold:
            drive.stop(reason, drive.settings.abort_ramp)
        until = time.monotonic() + drive.stopping_time + ARRIVES.nanoseconds * 1e-9
        while drive.state == "stopping" and beat.alive and time.monotonic() < until:
            self._obey_stop()
            time.sleep(beat.clock.period)
        beat.close()
        self._beat = None
        self._report()
        for _ in range(LAST):
            self._commands.rest(drive)
            time.sleep(beat.clock.period)
        self._publish_rows()
        self._commands.publisher.wait_for_all_acked(ARRIVES)

    # the data path

    def _on_joints(self, stamp: float, values: FloatArray) -> None:
        """(axes,) positions at a ROS time, s."""
        with self._hold:
            drive = self._drive
            if drive is None or self._beat is None or self._epoch is None:
                return
            seq = (stamp - self._epoch) * drive.settings.rate
            now = self.get_clock().now().nanoseconds * 1e-9
            overdue = max(int((now - self._epoch) * drive.settings.rate) + 1 - drive.seq, 0)
            if not drive.see(Block(drive.axes, np.array([seq]), np.array([stamp]), values[None, :]), overdue):
                self._complain(f"joint states: not usable ({drive.unusable})")

    def _on_beat(self, skipped: int) -> None:
        """Send one command, in the thread; after an error send the safe output, and end."""
        drive, commands, before = self._drive, self._commands, self._wall.count
        if drive is None or commands is None:
            return
        with self._wall, self._hold:
            drive.tick(time.monotonic())
            block = drive.catch_up(skipped)
            newest = self._stamp(float(block.seq[-1]))
            if commands.send(drive, block.values[-1], newest):
                self._blocks, self._until = self._blocks + 1, time.monotonic() + 1.0 / drive.settings.rate
                stamps = newest + (block.seq - block.seq[-1]) / drive.settings.rate
                self._rows += list(zip(block.seq.tolist(), stamps.tolist(), block.values, strict=True))
            if len(self._rows) >= drive.settings.block:
                self._publish_rows()
        if self._wall.count > before:
            for _ in range(LAST):
                commands.rest(drive)
            self.exit_code = 1
            if self._beat is not None:
                self._beat.close()

    def _stamp(self, seq: float) -> float:
        """ROS time of a command, s: evenly spaced, and close to the clock."""
        assert self._drive is not None and self._epoch is not None
        count = seq / self._drive.settings.rate
        apart = self.get_clock().now().nanoseconds * 1e-9 - count - self._epoch
        if isinstance(self._commands, Trajectories):  # a jump of the stamps would be a jump of the motion
            self._epoch += FOLLOW_MOTION * apart
        else:
            self._epoch += apart if abs(apart) > SAME_EPOCH else FOLLOW * apart
        return self._epoch + count

    def _publish_rows(self) -> None:
        """Publish the sent commands as a block, for identification and recording."""
        if self._rows and self._drive is not None:
            seq, time_, values = zip(*self._rows, strict=True)
            message = to_message(Block(self._drive.axes, np.array(seq), np.array(time_), np.array(values)))
            self._voltage.publish(message)
            if self._reference is not None:
                self._reference.publish(message)
            self._rows.clear()

    def _on_position(self, message: Float64MultiArray) -> None:
        drive = self._drive
        if drive is None or self._pace is None:
            return
        block: Block | None = None
        with self._wall:
            try:
                block = from_message(message)
            except BadInput as error:
                self._complain(f"position: {error}")
        if block is None:
            return
        if drive.settings.lockstep:
            self._answers.add(block)
            self._in_lockstep(drive)
        elif not drive.see(block):
            self._complain(f"position: not usable ({drive.unusable})")

    def _on_time(self) -> None:
        drive = self._drive
        if drive is None:
            return
        if self._commands is not None:
            self._after(drive)
            return
        now = time.monotonic()
        drive.tick(now)
        if drive.settings.lockstep:
            if not drive.answered and self._until is not None and now > self._until + KNOCK and drive.state == "active":
                self._send(drive)  # discovery was not complete when the last block was sent
            self._in_lockstep(drive)
            return
        drive.skip(self._pacer.skip(now) * drive.settings.block)
        for _ in range(min(CATCH_UP, self._pacer.due(now))):
            self._send(drive)
        self._after(drive)

    def _in_lockstep(self, drive: Drive) -> None:
        """Send block k as soon as it is due and the positions of block k - ahead have arrived; it depends on no later positions."""
        settings, now = drive.settings, time.monotonic()
        while drive.state != "stopped" and self._pacer.due(now) > 0:
            if self._blocks >= settings.ahead and not drive.blind:
                rows = self._answers.up_to(self._first + (self._blocks - settings.ahead + 1) * settings.block - 1)
                if rows is None:
                    self._pacer.slip(now)
                    break
                if not drive.see(rows):
                    self._complain(f"position: not usable ({drive.unusable})")
            self._send(drive)
        self._after(drive)

    def _send(self, drive: Drive) -> None:
        self._publish(drive.next(drive.settings.block))
        self._pacer.count(time.monotonic())
        self._blocks += 1
        self._until = time.monotonic() + self._pacer.period

    def _publish(self, block: Block) -> None:
        self._loud = bool(block.values.any())
        self._voltage.publish(to_message(Block(block.axes, block.seq, block.time + (self._epoch or 0.0), block.values)))

    def _after(self, drive: Drive) -> None:
        """Deactivate if the drive has ended by itself, and log the reason."""
        if drive.state == "stopped" and self._pace is not None:
            (self.get_logger().error if drive.fault else self.get_logger().info)(f"inactive: {drive.reason}")
            self.trigger_deactivate()
            if self._knobs.settings.autostart and drive.fault and not drive.answered:
                self.trigger_cleanup()
                self._wait_for_machine()
                self.get_logger().info("it starts again as soon as a machine is present: nothing has moved yet")

    # parameters, diagnostics, start

    def _accept(self, settings: ExcitationSettings) -> None:
        with self._hold:
            self._change(settings)

    def _change(self, settings: ExcitationSettings) -> None:
        if self._drive is not None and self._drive.state in ("active", "stopping"):
            self._drive.change(settings)

    def _complain(self, text: str) -> None:
        """Log a complaint, but not again if only its numbers differ."""
        kind = re.sub(r"[\d.]+", "", text)
        if kind != self._complaint:
            self._complaint = kind
            self.get_logger().warning(printable(text))

    def _report(self) -> None:
        drive = self._drive
        if drive is None:
            message, level, values = "not configured", 0, {"state": "idle"}
        else:
            with self._hold:
                report = drive.report()
            level = 2 if drive.fault else 0
            message = report.reason or {"idle": "waiting for activate", "active": "driving"}.get(report.state, report.state)
            values = {"state": report.state, "reason": report.reason, "blocks": str(self._blocks), "blocks_late": str(self._pacer.late)}
            for number, axis in enumerate(drive.axes):
                values[f"{axis}.rms"] = f"{report.rms[number]:.4g}"
                values[f"{axis}.clipped"] = f"{report.clipped[number]:.0f}"
                values[f"{axis}.braked"] = f"{report.braked[number]:.0f}"
        refused = self._recent.goes_on("refused", self._refusals, time.monotonic())
        stop = self._stop.why() if self._stop.held else ""
        if stop and stop != self._stop_told:  # again when the name of the sender becomes known, which may be after the message
            self.get_logger().warning(stop)
        self._stop_told = stop
        if stop or (refused and (drive is None or drive.state != "active")):
            message, level = stop or self._refused, max(level, 1)
        values[INPUT_UNIT], values[OUTPUT_UNIT] = self._knobs.settings.units
        values["stop"] = "on" if self._stop.held else "off"
        values["stop held by"] = ", ".join(self._stop.holders)
        values["listeners"] = str(self.count_subscribers(self._way))
        self._metrics.publish([status("excitation", level, message, values)])

    def _wait_for_machine(self) -> None:
        self._waiting_since, self._readers = time.monotonic(), 0
        self._autostart = self.create_timer(0.1, self._start_by_itself, clock=self._steady)

    def _start_by_itself(self) -> None:
        """Configure and activate as soon as a machine is present: one node that reads voltage and writes position."""
        if self.count_subscribers(self._way) == 0 or self._position.get_publisher_count() == 0:
            if time.monotonic() - self._waiting_since > self._knobs.settings.patience:
                self._complain(f"no machine yet: no node reads {self._way} and writes {self._position.topic_name}")
            return
        readers = {(info.node_namespace, info.node_name) for info in self.get_subscriptions_info_by_topic(self._way)}
        writers = {(info.node_namespace, info.node_name) for info in self.get_publishers_info_by_topic(self._position.topic_name)}
        if not readers & writers and time.monotonic() - self._waiting_since < SAME_NODE:
            return
        if len(readers) != self._readers:
            self._readers, self._settled_at = len(readers), time.monotonic() + SETTLED
        if time.monotonic() < self._settled_at:
            return
        others = self._others()
        if others or self._stop.held:
            self._complain(self._stop.why() if self._stop.held else f"{' and '.join(others)} publishes {self._way}, too: waiting. {KILLED}")
            return
        assert self._autostart is not None
        self.destroy_timer(self._autostart)
        self._autostart = None
        if self.trigger_configure() != TransitionCallbackReturn.SUCCESS or self.trigger_activate() != TransitionCallbackReturn.SUCCESS:
            self.exit_code = 2
        else:
            kinds = ", ".join(f"{item.name.partition('.')[0]} {item.value}" for item in knobs(self._knobs.settings) if item.name.endswith(".kind"))
            self.get_logger().info(f"driving: {kinds}")
