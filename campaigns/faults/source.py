"""Samples of a lagging integrator at 2 kHz, whose clock jumps and whose rate changes; for faults.desk: python -m campaigns.faults.source."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray

from xy_sysid.nodes.common import DATA_QOS
from xy_sysid.nodes.convert import to_message
from xy_sysid.samples.block import Block

ROWS = 20
# seconds of data, rate in Hz, offset of the clock in s
PARTS = ((5.0, 2000.0, 0.0), (4.0, 2000.0, 3600.0), (4.0, 2000.0, -86400.0), (4.0, 2000.0, 0.05), (6.0, 1000.0, 0.0))


def main() -> None:
    """Publish all parts in real time."""
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node: Any = rclpy.create_node("source", namespace="/xy", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    ends = {kind: node.create_publisher(Float64MultiArray, kind, DATA_QOS) for kind in ("voltage", "position")}
    while not all(end.get_subscription_count() for end in ends.values()):
        executor.spin_once(timeout_sec=0.1)
    random = np.random.default_rng(5)
    seq, epoch = 0, time.time()
    speed, place = np.zeros(2), np.zeros(2)
    for seconds, rate, offset in PARTS:
        keep = float(np.exp(-320.0 / rate))
        started, first = time.monotonic(), seq
        for _ in range(round(seconds * rate / ROWS)):
            u = random.normal(size=(ROWS, 2))
            y = np.empty_like(u)
            for row in range(ROWS):
                y[row] = place
                lag = speed - 0.1 * u[row]
                place = place + 0.1 * u[row] / rate + lag * (1 - keep) / 320.0
                speed = 0.1 * u[row] + keep * lag
            count = np.arange(seq, seq + ROWS, dtype=np.float64)
            stamps = epoch + offset + (count - first) / rate + first / 2000.0
            for kind, values in (("voltage", u), ("position", np.round(y / 5e-7) * 5e-7)):
                ends[kind].publish(to_message(Block(("x", "y"), count, stamps, values)))
            seq += ROWS
            time.sleep(max(0.0, started + (seq - first) / rate - time.monotonic()))
    node.destroy_node()
    context.try_shutdown()


if __name__ == "__main__":
    main()
