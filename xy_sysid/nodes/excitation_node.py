"""Lifecycle node that drives the axes: publishes ``voltage``, reads ``position``.

Nothing moves before ``activate``. Whatever ends it (deactivate, a guard, an error, Ctrl-C, SIGTERM), the last voltage
published is zero, and it has arrived before the node goes. Pacing, guards and signals are pure and live elsewhere.
"""

from __future__ import annotations

import math
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.timer import Timer
from std_msgs.msg import Float64MultiArray

from xy_sysid.drive import Drive
from xy_sysid.errors import BadInput
from xy_sysid.nodes.common import DATA_QOS, NAMESPACE, declare, from_message, overrides, status, to_message
from xy_sysid.pacing import CATCH_UP, Answers, Clock
from xy_sysid.settings import AxisExcitation, ExcitationSettings, knobs
from xy_sysid.stream import Block

ARRIVES = Duration(seconds=1.0)  # how long the last zero may take to be acknowledged
SETTLED = 0.5  # s without a new listener before starting by itself: whoever was started together hears the first sample
SAME_NODE = 2.0  # s to look for one node that reads voltage and writes position, before any two will do
AXES = "axes"


class ExcitationNode(LifecycleNode):
    """The adapter: time, topics, parameters and lifecycle around a Drive."""

    exit_code: int | None = None

    def __init__(self) -> None:
        super().__init__("excitation", namespace=NAMESPACE, automatically_declare_parameters_from_overrides=True)
        axes = overrides(self).get(AXES, ["x", "y"])
        if not isinstance(axes, list) or not all(isinstance(axis, str) and axis.isidentifier() for axis in axes):
            raise BadInput(f"node excitation: parameter {AXES}", axes, 'a list of names like ["x", "y"]', "Change it and try again.")
        if not self.has_parameter(AXES):
            self.declare_parameter(AXES, axes)
        defaults = ExcitationSettings(axes={axis: AxisExcitation(seed=number) for number, axis in enumerate(axes, start=1)})
        self._knobs = declare(self, defaults, self._accept, also=[AXES])
        self._drive: Drive | None = None
        self._pacer = Clock(0.0, 0.0)
        self._answers = Answers()
        self._blocks = 0  # sent since activation
        self._first = 0  # counter of the first sample since activation
        self._until: float | None = None  # when the last block sent is over
        self._loud = False  # the last block published was not all zeros
        self._complaint = ""
        self._voltage = self.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
        self._metrics = self.create_publisher(DiagnosticArray, "metrics", 10)
        self._position = self.create_subscription(Float64MultiArray, "position", self._on_position, DATA_QOS)
        self._pace: Timer | None = None
        self.create_timer(0.5, self._report)
        self._waiting_since = time.monotonic()
        self._readers, self._settled_at = 0, 0.0  # of the voltage, and when their number will have settled
        self._autostart: Timer | None = self.create_timer(0.1, self._start_by_itself) if self._knobs.settings.autostart else None
        self.get_logger().info(
            "unconfigured: nothing moves before configure and activate" + (", which come by themselves" if self._autostart else "")
        )

    # lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check that every signal fits the rate."""
        try:
            self._drive = Drive(self._knobs.settings)
        except BadInput as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin, at 0 V until the first position."""
        settings, now = self._knobs.settings, time.monotonic()
        if self._drive is not None and self._until is not None:
            self._first = self._drive.seq
            if not settings.lockstep:  # a pause is a gap in the counter
                self._first += max(1, math.ceil((now - self._until) * settings.rate * settings.speed))
        try:
            self._drive = Drive(settings, self._first)
        except BadInput as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        period = settings.block / settings.rate / settings.speed if settings.speed > 0 else 0.0
        self._pacer, self._answers, self._blocks = Clock(period, now), Answers(self._first - 1), 0
        self._drive.start()
        wake = min(0.01, settings.watchdog / 4, period / 2 if period > 0 else 0.01)
        self._pace = self.create_timer(max(wake, 0.001), self._on_time)
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fade out now, then zero."""
        self._finish("deactivated")
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Nothing to give back."""
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Fade out now, then zero."""
        self._finish("shut down")
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Zero, whatever went wrong."""
        self.last_words()
        return super().on_error(state)

    # the end of the process

    def ask_to_stop(self, reason: str) -> None:
        """Fade out in order while positions are still read."""
        if self._drive is not None:
            self._drive.stop(reason, self._drive.settings.ramp)

    def has_stopped(self) -> bool:
        """The last block published is zeros."""
        return self._drive is None or self._drive.state in ("idle", "stopped")

    def last_words(self) -> None:
        """Zero volts, even if the drive itself is what failed."""
        try:
            self._finish("ended")
        finally:
            if self._loud and self._drive is not None:
                block = self._drive.zeros(self._drive.settings.block)
                self._publish(block)
                self._voltage.wait_for_all_acked(ARRIVES)

    def _finish(self, reason: str) -> None:
        """Fade out without waiting for positions, at the pace of the machine, and see the zeros arrive."""
        if self._pace is not None:
            self.destroy_timer(self._pace)
            self._pace = None
        drive = self._drive
        if drive is None:
            return
        was_running = drive.state in ("active", "stopping")
        drive.stop(reason, drive.settings.abort_ramp)
        while drive.state == "stopping":
            self._send(drive)
            time.sleep(0.0 if drive.settings.lockstep else self._pacer.period)
        if was_running or self._loud:
            self._voltage.wait_for_all_acked(ARRIVES)

    # the data path

    def _on_position(self, message: Float64MultiArray) -> None:
        drive = self._drive
        if drive is None or self._pace is None:
            return
        try:
            block = from_message(message)
        except BadInput as error:
            self._complain(f"position: {error}")
            return
        if drive.settings.lockstep:
            self._answers.add(block)
            self._in_lockstep(drive)
        elif not drive.see(block):
            self._complain("position: not usable (not finite, absurdly far away, or not the axes of this node)")

    def _on_time(self) -> None:
        drive = self._drive
        if drive is None:
            return
        now = time.monotonic()
        drive.tick(now)
        if drive.settings.lockstep:
            self._in_lockstep(drive)
            return
        drive.skip(self._pacer.skip(now) * drive.settings.block)
        for _ in range(min(CATCH_UP, self._pacer.due(now))):
            self._send(drive)
        self._after(drive)

    def _in_lockstep(self, drive: Drive) -> None:
        """Block k goes out as soon as it is due and the positions of block k - ahead are there, and knows no later ones."""
        settings, now = drive.settings, time.monotonic()
        while drive.state != "stopped" and self._pacer.due(now) > 0:
            if self._blocks >= settings.ahead and not drive.blind:
                rows = self._answers.up_to(self._first + (self._blocks - settings.ahead + 1) * settings.block - 1)
                if rows is None:
                    self._pacer.slip(now)
                    break
                if not drive.see(rows):
                    self._complain("position: not usable (not finite, absurdly far away, or not the axes of this node)")
            self._send(drive)
        self._after(drive)

    def _send(self, drive: Drive) -> None:
        self._publish(drive.next(drive.settings.block))
        self._pacer.count(time.monotonic())
        self._blocks += 1
        self._until = time.monotonic() + self._pacer.period

    def _publish(self, block: Block) -> None:
        self._loud = bool(block.values.any())
        self._voltage.publish(to_message(block))

    def _after(self, drive: Drive) -> None:
        """Go inactive when the drive has come to its end by itself, and say why."""
        if drive.state == "stopped" and self._pace is not None:
            (self.get_logger().error if drive.blind else self.get_logger().info)(f"inactive: {drive.reason}")
            self.trigger_deactivate()

    # parameters, diagnostics, start

    def _accept(self, settings: ExcitationSettings) -> None:
        if self._drive is not None and self._drive.state in ("active", "stopping"):
            self._drive.change(settings)

    def _complain(self, text: str) -> None:
        """The same complaint once."""
        if text != self._complaint:
            self._complaint = text
            self.get_logger().warning(text)

    def _report(self) -> None:
        drive = self._drive
        if drive is None:
            message, level, values = "not configured", 0, {"state": "idle"}
        else:
            report = drive.report()
            level = 2 if drive.blind else 0
            message = report.reason or {"idle": "waiting for activate", "active": "driving"}.get(report.state, report.state)
            values = {"state": report.state, "reason": report.reason, "blocks": str(self._blocks), "blocks_late": str(self._pacer.late)}
            for number, axis in enumerate(drive.axes):
                values[f"{axis}.rms"] = f"{report.rms[number]:.4g}"
                values[f"{axis}.clipped"] = f"{report.clipped[number]:.0f}"
                values[f"{axis}.braked"] = f"{report.braked[number]:.0f}"
        values["listeners"] = str(self._voltage.get_subscription_count())
        stamped = DiagnosticArray(status=[status("excitation", level, message, values)])
        stamped.header.stamp = self.get_clock().now().to_msg()
        self._metrics.publish(stamped)

    def _start_by_itself(self) -> None:
        """Configure and activate once a machine is there: one node that reads voltage and writes position."""
        if self._voltage.get_subscription_count() == 0 or self._position.get_publisher_count() == 0:
            if time.monotonic() - self._waiting_since > self._knobs.settings.patience:
                self._complain(f"no machine yet: nobody reads {self._voltage.topic_name} and writes {self._position.topic_name}")
            return
        readers = {(info.node_namespace, info.node_name) for info in self.get_subscriptions_info_by_topic(self._voltage.topic_name)}
        writers = {(info.node_namespace, info.node_name) for info in self.get_publishers_info_by_topic(self._position.topic_name)}
        if not readers & writers and time.monotonic() - self._waiting_since < SAME_NODE:
            return
        if len(readers) != self._readers:
            self._readers, self._settled_at = len(readers), time.monotonic() + SETTLED
        if time.monotonic() < self._settled_at:
            return
        assert self._autostart is not None
        self.destroy_timer(self._autostart)
        self._autostart = None
        if self.trigger_configure() != TransitionCallbackReturn.SUCCESS or self.trigger_activate() != TransitionCallbackReturn.SUCCESS:
            self.exit_code = 2
        else:
            kinds = ", ".join(f"{item.name.partition('.')[0]} {item.value}" for item in knobs(self._knobs.settings) if item.name.endswith(".kind"))
            self.get_logger().info(f"driving: {kinds}")
