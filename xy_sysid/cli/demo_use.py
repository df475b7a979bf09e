"""xy-sysid demo --use: the identified models reduce the tracking error of a path on the simulated machine."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from xy_sim.machine import Machine
    from xy_sysid.processes.run_plan import ProcessSpec

SLOW, SLOW_PERIOD, CENTRING = 0.35, 15.0, 8.0  # V, s, V/m: a slow sine is added to the noise, so that the motion covers the travel of the path
SECONDS = 30.0  # of data, without a page
WAITS = 900.0  # s, timeout of the diagnosis, and of the path
NODE = "demo_follower"
BETTER = 1.0  # largest ratio of the error with the compensation to that with kS, kV and kA


def excited(axes: tuple[str, ...], specs: list[ProcessSpec]) -> list[ProcessSpec]:
    """The processes of the demo, with an excitation that covers the travel, and the controller."""
    from dataclasses import replace

    from xy_sysid.processes.run_plan import ProcessSpec

    more = [word for axis in axes for name, value in _slow().items() for word in ("-p", f"{axis}.{name}:={value}")]
    made = [replace(spec, command=(*spec.command, *more)) if spec.name == "excitation" else spec for spec in specs]
    env = (("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),)
    names = ",".join(f'"{axis}"' for axis in axes)
    command = (sys.executable, "-m", "xy_sysid.nodes.demo_follower", "--ros-args", "-p", f"axes:=[{names}]")
    return [ProcessSpec(NODE, command, env, stop_rank=0), *made]


def _slow() -> Mapping[str, float]:
    return {"slow": SLOW, "slow_period": SLOW_PERIOD, "centring": CENTRING}


def watch_use(specs: list[ProcessSpec], table: Machine, seconds: float, json: bool) -> int:
    """Identify, diagnose and use, without a page; returns the exit code: 1 unless the error fell on every axis."""
    import os

    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    from xy_sysid.cli.monitor import Monitor, refuse_others
    from xy_sysid.cli.output import aside, emit
    from xy_sysid.processes.starter import run

    aside.print("starting the nodes: a simulated table, an excitation, a diagnoser and the demo's controller, over ROS 2 ...")
    monitor = Monitor(table.axes)
    refuse_others(monitor)
    lines: list[str] = []
    story = Course(monitor, seconds, lambda words: aside.print(words, markup=False))
    begun = time.monotonic()
    try:
        code = run(excited(table.axes, specs), say=lines.append, enough=story.over)
    finally:
        monitor.close()
    found = {axis: story.errors(axis) for axis in table.axes}
    if code == 0:
        code = 0 if not story.failed and all(better(item) for item in found.values()) else 1
    if json:
        emit({"seconds": seconds, "wall_seconds": time.monotonic() - begun, "axes": found, "failed": story.failed, "exit_code": code})
    elif not story.failed:
        show(found)
    if story.failed:
        aside.print(story.failed, markup=False)
    if code not in (0, 1, 130, 143):
        for line in lines[-20:]:
            aside.print(line, markup=False)
    return code


def better(found: Mapping[str, Any]) -> bool:
    """True if each feedforward has a smaller error than the one before."""
    errors = list(found["errors"].values())
    return len(errors) == 3 and errors[1] < errors[0] and errors[2] <= BETTER * errors[1]


def show(found: Mapping[str, Mapping[str, Any]]) -> None:
    """Print the tracking errors as a table."""
    from xy_sysid.cli.output import say, table
    from xy_sysid.control_design.follower import KINDS

    rows = [(f"axis {axis}", *(f"{1e6 * value:.3g}" for value in item["errors"].values()), item["undone"]) for axis, item in found.items()]
    table("tracking error on the simulated machine, um rms", ("", *KINDS, "undone"), rows)
    say("The controller is the demo's own. For yours: xy-sysid use MODEL.")


class Course:
    """The sequence of the demo; ``over`` is called repeatedly."""

    def __init__(self, monitor: Any, seconds: float, tell: Any) -> None:
        from std_srvs.srv import Trigger

        self._monitor, self._seconds, self._tell, self._kind = monitor, seconds, tell, Trigger
        self._auto = monitor.client(Trigger, "diagnoser/auto")
        self._use = monitor.client(Trigger, f"{NODE}/use")
        self._call: Any = None
        self._step, self._since = 0, time.monotonic()
        self.failed = ""

    def over(self) -> bool:
        """Continue; returns True at the end."""
        self._monitor.spin(0.05)
        if self._step == 0:
            self._monitor.start_when_ready()
            heard = float(self._values("diagnoser").get("seconds heard (s)", "0"))
            if heard >= self._seconds:
                self._next("searching for the effects of both axes ...", self._auto)
        elif self._step == 1 and self._answered():
            self._next("Use it: designing the controllers, and following a path three times ...", self._use)
        elif self._step == 2 and self._answered():
            state = self._values(NODE).get("state", "")
            if state == "failed":
                self.failed = self._monitor.statuses[NODE][1]
            return bool(self.failed) or state == "done"
        if self._step and time.monotonic() - self._since > WAITS:
            self.failed = f"no answer in {WAITS:g} s; {NODE} says: {self._monitor.statuses.get(NODE, (0, 'nothing', {}))[1]}"
        return bool(self.failed)

    def errors(self, axis: str) -> dict[str, Any]:
        """Tracking errors by kind of feedforward, m rms, and the compensated effects."""
        from xy_sysid.control_design.follower import KINDS

        values = self._values(NODE)
        keys = {name: f"axis {axis} {name} (m)" for name in KINDS}
        return {"errors": {name: float(values[key]) for name, key in keys.items() if key in values}, "undone": values.get(f"axis {axis} undone", "")}

    def _values(self, name: str) -> dict[str, str]:
        return dict(self._monitor.statuses.get(name, (0, "", {}))[2])

    def _next(self, words: str, client: Any) -> None:
        if client.service_is_ready():
            self._tell(words)
            self._call, self._step, self._since = client.call_async(self._kind.Request()), self._step + 1, time.monotonic()

    def _answered(self) -> bool:
        if self._call is None or not self._call.done():
            return False
        answer = self._call.result()
        if not answer.success:
            self.failed = answer.message
        return True
