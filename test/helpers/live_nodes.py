"""Nodes under test: waiting for them, driving them, and a source of samples with faults."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import signal

from helpers.ros_tools import World
from xy_sysid.samples.block import Block

FAST: dict[str, Any] = {"lockstep": True, "speed": 0.0, "duration": 30.0, "block": 100}


def newest(statuses: list[Any], name: str) -> dict[str, str]:
    for status in reversed(statuses):
        if status.name == name:
            return {pair.key: pair.value for pair in status.values} | {"message": status.message, "level": str(status.level[0])}
    return {}


def ready(world: World, statuses: list[Any], *names: str) -> None:
    assert world.until(lambda: all(newest(statuses, name) for name in names), 40.0), f"not all of {names} came up"


def drive(world: World, statuses: list[Any], listeners: int = 2) -> None:
    """Activate once all nodes are connected, and wait for the end of the signal."""

    def all_there() -> bool:
        return all(int(newest(statuses, name).get("listeners", "0")) >= listeners for name in ("excitation", "ballscrew"))

    assert world.until(all_there, 20.0)
    assert world.transition("excitation", "configure")
    assert world.transition("excitation", "activate")
    assert world.until(lambda: newest(statuses, "excitation").get("state") == "stopped", 60.0)


class Source:
    """Publishes synthetic samples of a first-order integrating axis, block by block, with optional faults."""

    def __init__(self, world: World, axes: tuple[str, ...] = ("x", "y"), rate: float = 2000.0) -> None:
        from std_msgs.msg import Float64MultiArray

        from xy_sysid.nodes.common import DATA_QOS

        self.world, self.axes, self.rate = world, axes, rate
        self.publishers = {kind: world.node.create_publisher(Float64MultiArray, kind, DATA_QOS) for kind in ("voltage", "position")}
        random = np.random.default_rng(5)
        self.u = random.standard_normal((200_000, len(axes)))
        pole, gain, period = 20.0 * rate / 125.0, 0.1, 1.0 / rate  # rad/s, m/s/V, s: exact steps of a lagging integrator behind a hold
        a = float(np.exp(-pole * period))
        speed = signal.lfilter([0.0, gain * (1 - a)], [1.0, -a], self.u, axis=0)
        steps = gain * period * self.u + (speed - gain * self.u) * (1 - a) / pole
        path = np.cumsum(steps, axis=0) - steps
        self.y = np.round(path / 5e-7) * 5e-7

    def found(self) -> bool:
        return all(p.get_subscription_count() > 0 for p in self.publishers.values())

    def send(self, first: int, last: int, block: int = 200, shift: int = 0) -> None:
        from xy_sysid.nodes.convert import to_message

        for start in range(first, last, block):
            rows = slice(start, min(start + block, last))
            seq = np.arange(rows.start, rows.stop, dtype=float) - shift
            for kind, values in (("voltage", self.u), ("position", self.y)):
                self.publishers[kind].publish(to_message(Block(self.axes, seq, seq / self.rate, values[rows])))
            self.world.spin(0.002)
