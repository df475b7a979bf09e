"""The adapter around ``machine.Machine``: answers every voltage block with the positions at its samples' instants.

It steps when a block comes, so it runs in lockstep with whoever sends them, in real time or many times faster. When the
voltage stops for a while, the amplifier is off: the table coasts at 0 V, and its encoder goes on reporting.
"""

from __future__ import annotations

import time

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray

from xy_sim.machine import Machine
from xy_sysid.errors import BadInput
from xy_sysid.nodes.common import DATA_QOS, NAMESPACE, Ending, declare, from_message, status, to_message
from xy_sysid.settings import BallscrewSettings
from xy_sysid.stream import Block

IDLE = 0.1  # s without voltage after which the encoder reports by itself, the motors off


class BallscrewNode(Node, Ending):
    """Voltage in, position out."""

    def __init__(self) -> None:
        super().__init__("ballscrew", namespace=NAMESPACE, automatically_declare_parameters_from_overrides=True)
        self._own = declare(self, BallscrewSettings(), self._accept)
        settings = self._own.settings
        self._machine = Machine.from_file(settings.machine, settings.seed or None, settings.clean)
        self._machine.step(np.zeros((1, len(self._machine.axes))))  # compile before anybody waits
        self._machine.reset()
        self._next: int | None = None
        self._heard = time.monotonic()
        self._faults: dict[str, int] = {}
        self._said = "waiting for voltage"
        self._position = self.create_publisher(Float64MultiArray, "position", DATA_QOS)
        self._metrics = self.create_publisher(DiagnosticArray, "metrics", 10)
        self.create_subscription(Float64MultiArray, "voltage", self._on_voltage, DATA_QOS)
        self.create_timer(0.5, self._report)
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
        first = int(block.seq[0])
        if self._next is not None and first < self._next:
            if first != 0:
                self._fault("old", f"voltage from counter {first} came after {self._next}")
                return
            self._fault("restart", "the voltage source started again; the table stays where it is")
        elif self._next is not None and first > self._next:
            missing = first - self._next
            self._fault("lost", f"{missing} samples of voltage from counter {self._next} on never came; the motors were off")
            self._machine.step(np.zeros((min(missing, round(self._machine.rate)), len(self._machine.axes))))
        self._next = int(block.seq[-1]) + 1
        columns = [block.axes.index(axis) for axis in self._machine.axes]
        positions = self._machine.step(np.ascontiguousarray(block.values[:, columns]))
        self._position.publish(to_message(Block(self._machine.axes, block.seq, block.time, positions)))

    def _fault(self, what: str, text: str) -> None:
        self._faults[what] = self._faults.get(what, 0) + 1
        if text != self._said:
            self.get_logger().warning(text)
        self._said = text

    def _report(self) -> None:
        silent = time.monotonic() - self._heard > IDLE
        message = "no voltage: motors off" if silent else "moving"
        level = 1 if self._faults and not silent else 0
        listeners = str(self._position.get_subscription_count())
        values = {
            "samples": str(self._machine.samples),
            "listeners": listeners,
            **{f"voltage {what}": str(number) for what, number in self._faults.items()},
        }
        stamped = DiagnosticArray(status=[status("ballscrew", level, self._said if self._faults else message, values)])
        stamped.header.stamp = self.get_clock().now().to_msg()
        self._metrics.publish(stamped)
