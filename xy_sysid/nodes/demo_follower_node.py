"""DEMO ONLY: a small controller that drives the simulated machine of ``xy-sysid demo --use`` along a path. It is no controller for a real machine.

On request (service ``~/use``) it takes the newest models from the stories, stops the excitation, and follows a path three times: with a PID alone,
with kS, kV and kA, and with the compensation. It drives only if a simulated machine (node ``ballscrew``) answers. Each block of voltages is
sent when the positions of the previous block have arrived; a real machine does not wait, so it cannot be driven with this node.
"""

from __future__ import annotations

import functools
import json
import threading
import time
from typing import Any

import numpy as np
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import Bool, Float64MultiArray, String
from std_srvs.srv import Trigger

from xy_sysid.control_design.follower import KINDS, Follower, Tryout, plan
from xy_sysid.control_design.path import Bounds, Moves
from xy_sysid.control_design.worth import encoder_of_floor
from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.files.story_models import model_of
from xy_sysid.live.plain_messages import ERROR, OK, WARN, ArrayMessage, topic_of
from xy_sysid.live.status_values import METRES
from xy_sysid.nodes.common import DATA_QOS, LATCHED_QOS, STOP_TOPIC, WalledNode, declare_fixed, overrides
from xy_sysid.nodes.convert import array_to_ros, from_message, status, to_message
from xy_sysid.nodes.diagnostics import Diagnostics
from xy_sysid.nodes.streams import answered
from xy_sysid.samples.block import Block

BLOCK = 4  # samples of a block: the feedback is calculated 500 times a second at 2 kHz
PARAMETERS = {"distance": 0.02, "speed": 0.06, "acceleration": 1.0, "limit": 10.0}  # m, m/s, m/s2, V
MEANINGS = {
    "distance": "length of the path to each side of the start, m",
    "speed": "largest speed of the path, m/s",
    "acceleration": "its largest acceleration, m/s2",
    "limit": "largest voltage, V",
}
JERK_TIME = 0.02  # s in which an acceleration is built up
LOOK, BEAT = 0.05, 0.5  # s between two checks, and between two statuses
QUIET = 0.5  # s without a position after which no drive is active
FOUND = 0.5  # s in which the machine finds a new source of voltage
SILENT = 3.0  # s without an answer after which the path is cancelled
SHOWN = 600  # approximate number of rows in the table of errors
IDLE, STOPPING, DESIGNING, FOLLOWING, DONE, FAILED = "idle", "stopping the excitation", "designing", "following", "done", "failed"
BUSY = (STOPPING, DESIGNING, FOLLOWING)
MACHINE = "ballscrew"  # the node of the simulated machine


class DemoFollowerNode(WalledNode):
    """Receives stories; on request publishes voltage until the path is complete."""

    def __init__(self) -> None:
        super().__init__("demo_follower")
        given = overrides(self)
        for name, value in PARAMETERS.items():
            declare_fixed(self, name, float(given.get(name, value)), MEANINGS[name])
        self._axes = tuple(given.get("axes", ["x", "y"]))
        declare_fixed(self, "axes", list(self._axes), "names of the axes")
        self._stories: dict[str, dict[str, Any]] = {}
        self._state, self._words = IDLE, "press Use it when the axes are diagnosed"
        self._errors: dict[str, list[float]] = {}
        self._plans: dict[str, Tryout] | BadInput | None = None
        self._followers: dict[str, Follower] = {}
        self._here: Block | None = None  # the newest position
        self._next, self._heard, self._stopped = 0, 0.0, False
        self._rate, self._epoch = 1.0, 0.0  # Hz; s, time of the sample with counter 0
        self._voltage: Any = None
        self._metrics = Diagnostics(self)
        self._tables = {axis: self.create_publisher(Float64MultiArray, topic_of("tracking", axis), LATCHED_QOS) for axis in self._axes}
        self._excitation = self.create_client(ChangeState, "excitation/change_state")
        for axis in self._axes:
            self.create_subscription(String, topic_of("story", axis), functools.partial(self._on_story, axis), LATCHED_QOS)
        self.create_subscription(Float64MultiArray, "position", self._on_position, DATA_QOS)
        for quality in (LATCHED_QOS, 10):
            self.create_subscription(Bool, STOP_TOPIC, self._on_stop, quality)
        self.create_service(Trigger, "~/use", functools.partial(answered, self._use))
        self.create_timer(LOOK, self._look)
        self.create_timer(BEAT, self._report)

    def _number(self, name: str) -> float:
        return float(self.get_parameter(name).value or 0.0)

    # subscriptions

    def _on_story(self, axis: str, message: String) -> None:
        self._stories[axis] = json.loads(message.data)

    def _on_stop(self, message: Bool) -> None:
        self._stopped = bool(message.data)
        if self._stopped and self._state in BUSY:
            self._end(FAILED, "STOP: the voltage is zero")

    def _on_position(self, message: Float64MultiArray) -> None:
        self._here = block = from_message(message)
        if self._state == FOLLOWING and block.seq[-1] != self._next - 1:
            return
        self._heard = time.monotonic()
        if self._state != FOLLOWING:
            return
        self._send(block)

    # actions

    def _use(self) -> str:
        """Start. Raises BadInput without a model or a simulated machine, while STOP is on, or during another action."""
        if self._state in BUSY:
            raise BadInput("demo_follower", self._state, "one path at a time", "Wait until it is over.")
        if self._stopped:
            raise BadInput("STOP", "on", "off", "Release it first.")
        if MACHINE not in self.get_node_names():
            raise BadInput("machine", "not simulated", f"the simulated machine (node {MACHINE})", "This controller is for the demo only.")
        models = {}
        for axis in self._axes:
            if axis not in self._stories:
                raise BadInput(f"axis {axis}", "without a story", "a diagnosed axis", "Press Diagnose or Auto first.")
            models[axis] = model_of(self._stories[axis], axis)
        if self._here is None:
            raise BadInput("position", "not heard", "a machine that answers", "Activate the excitation, so that the positions of the axes are known.")
        self._state, self._words, self._errors, self._plans = STOPPING, "the excitation is stopped", {}, None
        if self._excitation.service_is_ready():
            request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
            self._excitation.call_async(request)  # refused if it is already inactive
        rates = {axis: float(self._stories[axis]["sampling_rate"]) for axis in self._axes}
        floors = {axis: float(self._stories[axis]["model"]["noise_floor"]) for axis in self._axes}
        threading.Thread(target=self._design, args=(models, rates, floors), daemon=True).start()
        return "the controllers are being designed; then the path is followed three times"

    def _design(self, models: dict[str, Any], rates: dict[str, float], floors: dict[str, float]) -> None:
        """Design the plans in a separate thread, because this takes seconds."""
        far, speed, acceleration, limit = (self._number(name) for name in PARAMETERS)
        bounds, places = Bounds(speed, acceleration, acceleration / JERK_TIME), (0.0, far, -far, 0.0)
        try:
            self._plans = {
                axis: plan(model, Moves(places, bounds, rates[axis]), BLOCK, limit, encoder_of_floor(floors[axis], rates[axis]))
                for axis, model in models.items()
            }
        except XySysidError as problem:
            self._plans = BadInput("path", "not to be followed", "a model that makes a controller", str(problem))

    @property
    def _quiet(self) -> bool:
        """True if no node drives: the simulated machine publishes no positions."""
        return time.monotonic() - self._heard > QUIET

    def _look(self) -> None:
        if self._state in (STOPPING, DESIGNING) and self._plans is not None:
            if isinstance(self._plans, BadInput):
                self._end(FAILED, str(self._plans))
            elif self._quiet and self._here is not None:
                self._begin(self._plans)
        elif self._state == STOPPING and self._quiet:
            self._state, self._words = DESIGNING, "PID, kS kV kA and compensation are designed for each axis"
        elif self._state == FOLLOWING and not self._next:
            if self._voltage.get_subscription_count() and time.monotonic() - self._heard > FOUND and self._here is not None:
                self._send(self._here.rows(len(self._here) - 1, len(self._here)))
        elif self._state == FOLLOWING and time.monotonic() - self._heard > SILENT:
            self._end(FAILED, f"the machine has not answered for {SILENT:g} s")

    def _begin(self, plans: dict[str, Tryout]) -> None:
        assert self._here is not None
        length = max(item.path.position.size for item in plans.values())
        columns = {axis: self._here.axes.index(axis) for axis in plans}
        self._followers = {axis: Follower(item, float(self._here.values[-1, columns[axis]]), length) for axis, item in plans.items()}
        self._rate = next(iter(plans.values())).path.sampling_rate
        self._next, self._epoch = 0, self.get_clock().now().nanoseconds * 1e-9  # a new source of voltage starts at counter 0
        self._voltage = self.create_publisher(Float64MultiArray, "voltage", DATA_QOS)
        self._state, self._words, self._heard = FOLLOWING, "", time.monotonic()

    def _send(self, here: Block) -> None:
        """Send the next block for the newest readings, or end after the path."""
        followers = list(self._followers.values())
        shown = here.values[:, [here.axes.index(axis) for axis in self._followers]]
        if all(item.over for item in followers):
            for item, row in zip(followers, shown.T, strict=True):
                item.see(row)
            self._end(DONE, "the path was followed three times")
            return
        values = np.column_stack([item.step(row) for item, row in zip(followers, shown.T, strict=True)])
        self._publish(values)

    def _publish(self, values: Any) -> None:
        seq = np.arange(self._next, self._next + len(values), dtype=np.float64)
        self._next += len(values)
        self._voltage.publish(to_message(Block(tuple(self._followers), seq, self._epoch + seq / self._rate, np.ascontiguousarray(values))))

    def _end(self, state: str, words: str) -> None:
        """Send zero volts, publish the tables, and report the result."""
        if self._voltage is not None:
            self._publish(np.zeros((BLOCK, len(self._followers))))
            self._voltage.wait_for_all_acked()
            self.destroy_publisher(self._voltage)
            self._voltage = None
        self._state, self._words = state, words
        self._measure(whole=True)
        self._report()

    def _measure(self, whole: bool = False) -> None:
        """Update the rms errors; whole: publish the tables too."""
        for axis, follower in self._followers.items():
            found = follower.errors()
            self._errors[axis] = [float(np.sqrt(np.mean(item**2))) for item in found]
            if whole and len(found) == len(KINDS):
                path = follower.plan.path
                rows = np.column_stack([np.arange(path.position.size) / path.sampling_rate, path.position, *found])
                rows = rows[:: max(len(rows) // SHOWN, 1)]
                columns = "time,path," + ",".join(name.replace(",", "") for name in KINDS)
                message = ArrayMessage("tracking", ("sample", columns), (len(rows), rows.shape[1]), np.ascontiguousarray(rows).ravel())
                self._tables[axis].publish(array_to_ros(message))

    def _report(self) -> None:
        """Publish ``metrics``: the current activity, and the errors so far."""
        values, told = {"state": self._state}, self._words
        if self._state == FOLLOWING:
            self._measure()
            kind = next(iter(self._followers.values())).kind
            told = "moving to the start of the path" if kind is None else f"following the path: {KINDS[kind]}"
        for axis, errors in self._errors.items():
            values |= {f"axis {axis} {name}{METRES}": f"{value:.6g}" for name, value in zip(KINDS, errors, strict=False)}
            values[f"axis {axis} undone"] = ", ".join(self._followers[axis].plan.compensation.terms)
        level = {FAILED: ERROR, IDLE: OK, DONE: OK}.get(self._state, WARN if self._stopped else OK)
        self._metrics.publish([status("demo_follower", level, told, values)])

    def last_words(self) -> None:
        """Leave no voltage on the machine."""
        if self._voltage is not None:
            self._end(FAILED, "the controller ends")
