"""Conducts the first run: the excitation drives, with all its guards; this node requests each push and receives voltage and position.

``excitation.first_run`` decides; this module has only time, topics and services.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64MultiArray

from xy_sysid.errors import BadInput
from xy_sysid.excitation.first_run import AxisFound, FirstRun, Push
from xy_sysid.nodes.common import DATA_QOS, NAMESPACE
from xy_sysid.nodes.convert import from_message
from xy_sysid.nodes.excitation_client import ANSWER, NODE, ExcitationClient
from xy_sysid.nodes.hearing import Ear
from xy_sysid.nodes.wall import Wall
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import ExcitationSettings

TRIES = 5  # attempts of a push whose messages do not all arrive
REST, FORTH = 0.12, 0.15  # s at 0 V before, between and after pushes, and s of each push


class Conductor(ExcitationClient):
    """``run`` conducts the first run, and returns when the machine stands. ended: called often; true if the user wants to stop."""

    def __init__(self, say: Callable[[str], None], ended: Callable[[], bool], namespace: str = NAMESPACE) -> None:
        self.found: dict[str, AxisFound] = {}
        self.problem = ""
        super().__init__("first_run", ended, namespace)
        self._say = say
        self._blocks: dict[str, dict[float, Block]] = {"voltage": {}, "position": {}}
        self._reason = ""
        self._wall = wall = Wall(lambda words: None, "ended by an error of its own, please report it")  # reported as the problem
        for topic in self._blocks:
            Ear(self._node, Float64MultiArray, topic, wall.around(self._keeper(topic)), DATA_QOS)
        self._node.create_subscription(DiagnosticArray, "metrics", wall.around(self._on_statuses), 100)

    def run(self) -> bool:
        """True if there was no problem; ``problem`` is a sentence on it, ``found`` the results by axis."""
        with self._wall:
            try:
                self._conduct()
            except BadInput as problem:
                self.problem = str(problem)
        self.problem = self._wall.told or self.problem
        if self.problem:
            self._say(self.problem)
        return not self.problem

    def _conduct(self) -> None:
        settings = self.settings()
        if self.state() == "active":
            raise BadInput("first run", "the excitation drives already", "an excitation that is not active", "Take autostart out of the run file.")
        first = FirstRun(settings)
        quiet: dict[str, Any] = {
            f"{axis}.{name}": value for axis in settings.axes for name, value in (("kind", "off"), ("centring", 0.0), ("offset", 0.0))
        }
        self.set(quiet)
        if self.state() == "unconfigured":
            self.transition("configure")
        self.transition("activate")
        try:
            while not self._over() and (push := first.next()) is not None:
                samples = self._push(push, settings)
                if self._over():  # part of a push shows nothing about the machine
                    break
                self._say(first.took(*samples).sentence)
            self.problem = self.problem or (f"the excitation stopped: {self._reason}" if self._reason else first.problem)
        finally:
            self._rest()
        for axis in first.axes:
            self.found[axis] = first.found(axis)
            if not self.problem:
                self._say(first.summary(axis))

    def _rest(self) -> None:
        """Deactivate; a failure is reported unless another problem is."""
        try:
            if self.state() == "active":
                self.transition("deactivate")
        except BadInput as problem:
            self.problem = self.problem or str(problem)

    def _push(self, push: Push, settings: ExcitationSettings) -> tuple[FloatArray, FloatArray]:
        """(n, axes) voltage and position of a push, which is repeated if messages are missing, as on a busy machine. Raises BadInput."""
        column = tuple(settings.axes).index(push.axis)
        for _ in range(TRIES):
            voltage, position, whole = self._pushed(push, settings)
            if self._over() or (whole and all(bool(np.any(sign * voltage[:, column] > 0.5 * push.volts)) for sign in (1.0, -1.0))):
                return voltage, position
        what, value = f"push of {push.axis} at {push.volts:.3g} V", f"without all its messages, {TRIES} times"
        raise BadInput(what, value, "streams without a gap", "Run fewer other programs on this computer, or check the network.")

    def _pushed(self, push: Push, settings: ExcitationSettings) -> tuple[FloatArray, FloatArray, bool]:
        """(n, axes) voltage and position of rest, forth, rest, back, rest, and whether they have no gap."""
        self.set({f"{push.axis}.breakaway": push.volts})  # friction is searched for: up to this voltage it is no fault
        for blocks in self._blocks.values():
            blocks.clear()
        self.wait(REST)
        self._heard(REST * settings.rate)
        for volts in (push.volts, 0.0, -push.volts, 0.0):
            if not self._over():
                self.set({f"{push.axis}.offset": volts})
                self.wait(FORTH if volts else REST)
        axes = tuple(settings.axes)
        both = sorted(self._blocks["voltage"].keys() & self._blocks["position"].keys())
        rows = [np.empty((0, len(axes)))]
        kept = {topic: np.concatenate([*rows, *(_columns(blocks[seq], axes) for seq in both)]) for topic, blocks in self._blocks.items()}
        ends = [float(self._blocks["voltage"][seq].seq[-1]) for seq in both]
        return kept["voltage"], kept["position"], bool(both) and [end + 1 for end in ends[:-1]] == both[1:]

    def _over(self) -> bool:
        if self._is_over():
            self.problem = self.problem or "stopped before the end"
        if self._wall.count:
            self.problem = self.problem or self._wall.told
        return bool(self.problem or self._reason)

    # subscriptions

    def _keeper(self, topic: str) -> Callable[[Float64MultiArray], None]:
        def keep(message: Float64MultiArray) -> None:
            block = from_message(message)
            if len(block):
                self._blocks[topic][float(block.seq[0])] = block

        return keep

    def _on_statuses(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == NODE and status.level == b"\x02":
                self._reason = status.message

    # waiting

    def _heard(self, samples: float) -> None:
        """Wait until both streams have this many samples since the last push, or until a timeout."""
        until = time.monotonic() + ANSWER
        while min(sum(len(block) for block in blocks.values()) for blocks in self._blocks.values()) < samples:
            if time.monotonic() > until or self._over():
                return
            self._executor.spin_once(timeout_sec=0.01)


def _columns(block: Block, axes: tuple[str, ...]) -> FloatArray:
    missing = [axis for axis in axes if axis not in block.axes]
    if missing:
        return np.full((len(block), len(axes)), np.nan)
    return block.values[:, [block.axes.index(axis) for axis in axes]]
