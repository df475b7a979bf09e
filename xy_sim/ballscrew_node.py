"""The adapter around ``machine.Machine``: answers every voltage block with the positions at its samples' instants.

It steps when a block arrives, so it runs in lockstep with the sender, in real time or many times faster. Without
voltage the simulation pauses, unless ``realtime`` is on: then the drive holds the last voltage for ``watchdog`` seconds
(0: permanently), and the table continues to move and to report positions.
"""

from __future__ import annotations

import time

import numpy as np
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from std_msgs.msg import Float64MultiArray

from xy_sim.machine import Machine
from xy_sysid.errors import BadInput
from xy_sysid.live.recent import Recent
from xy_sysid.nodes.common import DATA_QOS, WalledNode, declare
from xy_sysid.nodes.convert import from_message, status, to_message
from xy_sysid.nodes.diagnostics import Diagnostics
from xy_sysid.samples.block import Block
from xy_sysid.settings import BallscrewSettings

GO_ON = 0.005  # s between two checks whether the next block is late
LATE = 0.02  # s that a block may be late before the table moves without it
OTHER = 0.5  # s by which the time of counter 0 must differ to count as a restart of the voltage source
IDLE = 0.1  # s without voltage after which the status says that the motors are off


class BallscrewNode(WalledNode):
    """Receives voltage and publishes position."""

    def __init__(self) -> None:
        super().__init__("ballscrew")
        self._own = declare(self, BallscrewSettings(), self._accept, fixed=None)
        settings = self._own.settings
        self._machine = Machine.from_file(settings.machine, settings.seed or None, settings.clean)
        self._machine.step(np.zeros((1, len(self._machine.axes))))  # compile in advance
        self._machine.reset()
        self._next: int | None = None
        self._until = 0.0  # steady time at which the last block ends, s
        self._heard = time.monotonic()
        self._epoch = 0.0  # s, time of the sample with counter 0, from the voltage stream
        self._faults: dict[str, int] = {}
        self._recent = Recent()
        self._said = "waiting for voltage"
        self._position = self.create_publisher(Float64MultiArray, "position", DATA_QOS)
        self._metrics = Diagnostics(self)
        self.create_subscription(Float64MultiArray, "voltage", self._on_voltage, DATA_QOS)
        self._held = np.zeros(len(self._machine.axes))  # the last voltage
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(0.5, self._report, clock=steady)
        if settings.realtime:
            self.create_timer(GO_ON, self._go_on, clock=steady)
        self.get_logger().info(f"simulating {self._machine.spec.description or settings.machine}: axes {', '.join(self._machine.axes)}")

    def _accept(self, settings: BallscrewSettings) -> None:
        if getattr(self, "_machine", None) is not None and settings != self._own.settings:
            raise BadInput("machine", "not to be changed while it runs", "as it is", "Start the node again.")

    def _on_voltage(self, message: Float64MultiArray) -> None:
        self._heard = time.monotonic()
        try:
            block = from_message(message)
            missing = [axis for axis in self._machine.axes if axis not in block.axes]
            if missing:
                raise BadInput("voltage", f"without {', '.join(missing)}", ", ".join(self._machine.axes), "Drive every axis, at 0 V if at rest.")
            if not bool(np.isfinite(block.values).all() and np.isfinite(block.seq).all()):
                raise BadInput("voltage", "not finite", "finite numbers", "Check who publishes it.")
        except BadInput as problem:
            self._fault("refused", str(problem))
            return
        self._answer(block)

    def _answer(self, block: Block) -> None:
        if self._own.settings.realtime and self._next is not None and block.seq[0] < self._next <= block.seq[-1]:
            late = int(self._next - block.seq[0])  # the table has moved without them in the meantime
            self._fault("late", f"{late} samples of voltage came after their time")
            block = Block(block.axes, block.seq[late:], block.time[late:], block.values[late:])
        first = int(block.seq[0])
        if self._next is not None and first < self._next:
            begun = float(block.time[0] - first / self._machine.rate)
            if first != 0 and abs(begun - self._epoch) <= OTHER:
                self._fault("old", f"voltage from counter {first} came after {self._next}")
                return
            self._fault("restart", "the voltage source started again; the table stays where it is")
        elif self._next is not None and first > self._next:
            missing = first - self._next
            self._fault("lost", f"{missing} samples of voltage from counter {self._next} on never came; the motors were off")
            self._machine.step(np.zeros((min(missing, round(self._machine.rate)), len(self._machine.axes))))
        self._next, self._until = int(block.seq[-1]) + 1, time.monotonic() + len(block) / self._machine.rate
        columns = [block.axes.index(axis) for axis in self._machine.axes]
        self._held, self._epoch = block.values[-1, columns].copy(), float(block.time[-1] - block.seq[-1] / self._machine.rate)
        positions = self._machine.step(np.ascontiguousarray(block.values[:, columns]))
        self._position.publish(to_message(Block(self._machine.axes, block.seq, block.time, positions)))

    def _go_on(self) -> None:
        """If the next block is late, simulate the time that has passed, with the last voltage or, after the watchdog time, with 0 V."""
        now, rate = time.monotonic(), self._machine.rate
        if self._next is None or now < self._until + LATE:
            return
        samples = min(round((now - self._until) * rate), round(rate))
        watchdog = self._own.settings.watchdog
        if watchdog > 0 and now - self._heard > watchdog:
            if self._held.any():
                self._fault("watchdog", f"no voltage for {watchdog * 1000:g} ms: the drive went to 0 V")
            self._held = np.zeros(len(self._held))
        positions = self._machine.step(np.tile(self._held, (samples, 1)))
        seq = np.arange(self._next, self._next + samples, dtype=np.float64)
        self._next, self._until = self._next + samples, self._until + samples / rate
        self._position.publish(to_message(Block(self._machine.axes, seq, self._epoch + seq / rate, positions)))

    def _fault(self, what: str, text: str) -> None:
        self._faults[what] = self._faults.get(what, 0) + 1
        if text != self._said:
            self.get_logger().warning(text)
        self._said = text

    def _report(self) -> None:
        silent = time.monotonic() - self._heard > IDLE
        message = "no voltage: motors off" if silent else "moving"
        goes_on = self._recent.goes_on("faults", sum(self._faults.values()), time.monotonic())
        level = 1 if goes_on and not silent else 0
        listeners = str(self._position.get_subscription_count())
        values = {
            "samples": str(self._machine.samples),
            "listeners": listeners,
            **{f"voltage {what}": str(number) for what, number in self._faults.items()},
        }
        self._metrics.publish([status("ballscrew", level, self._said if goes_on else message, values)])
