"""Conducts a walk to a settled diagnosis on the machine: records, has the next experiment designed, runs it, and so on.

``experiment_design.walk`` decides, in a separate process; this module has only time, topics, services and bags. The excitation checks every
experiment with its own limits again. Afterwards its settings are restored.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.qos import HistoryPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from xy_sysid.bags import BagWriter
from xy_sysid.bags.atomic import write_text
from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.excitation.designed import of_an_experiment
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.experiment_design.limits import MachineLimits, most_of, of_settings
from xy_sysid.experiment_design.loop import Budget
from xy_sysid.experiment_design.walk import RobotJoint, WalkPlan, still_open
from xy_sysid.files.trajectories import as_csv
from xy_sysid.files.walk import plan_document, write_walk
from xy_sysid.nodes.common import NAMESPACE
from xy_sysid.nodes.convert import from_message
from xy_sysid.nodes.excitation_client import ASKED, NODE, ExcitationClient
from xy_sysid.nodes.wall import Wall
from xy_sysid.processes.settle_process import Decider, DecisionNews
from xy_sysid.settings import ExcitationSettings, knobs
from xy_sysid.story.attempt import BROKEN
from xy_sysid.units import USUAL, Units

FIRST = 12.0  # s of the first recording, with the excitation at the beginning of the walk
WHOLE = 0.95  # part of its duration after which an experiment counts as complete; a shorter one was stopped
LATE = 10.0  # s of wall-clock time without a sample after which a recording ends
SETTLES = 0.5  # s in which the excitation publishes its state after a change
READERS = ("diagnoser", "identifier")
QUALITY = QoSProfile(depth=1000, history=HistoryPolicy.KEEP_LAST)


@dataclass(frozen=True, slots=True)
class Wishes:
    """The request. axis: its name; folder: for bags and decisions, new; sets: of effects to distinguish, empty: those of the diagnosis
    budget: of the walk; first: s of the first recording; alone: start to drive without waiting for activation
    """

    axis: str
    folder: Path
    sets: tuple[tuple[str, ...], ...] = ()
    budget: Budget = field(default_factory=lambda: Budget(experiments=4))
    first: float = FIRST
    alone: bool = False
    effect_files: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Effort:
    """The effort in joint states, as the diagnoser reads it. lag: samples by which it is older than its stamp; unit: empty: N m or N."""

    lag: int = 0
    unit: str = ""


def plan_of(wishes: Wishes, settings: ExcitationSettings, effort: Effort | None = None, namespace: str = NAMESPACE) -> WalkPlan:
    """The plan of a walk on a machine with these settings and limits.

    effort: of a robot that takes only trajectories. Raises BadInput for an unknown axis, and for other robots that take positions.
    """
    axis = wishes.axis
    if axis not in settings.axes:
        raise BadInput("axis", repr(axis), ", ".join(settings.axes), "Choose an axis that the excitation drives.")
    if settings.holds and settings.command != "joint_trajectory":
        act = "Design one with xy-sysid next --trajectory, and run it there."
        raise BadInput("interface", "position", "effort or velocity, since an experiment moves the axis by itself, or joint_trajectory", act)
    own, units, robot = of_settings(settings, axis), settings.units, None
    if settings.holds:
        effort = effort or Effort()
        units = Units(effort.unit or {"m": "N", "rad": "N m"}[settings.unit], settings.unit)
        joint = dict(pair.split("=", 1) for pair in settings.joints if pair).get(axis, axis)
        robot = RobotJoint(joint, absolute(settings.joint_topic, namespace), settings.rate, effort.lag)
        own["voltage"] = most_of("limit")
    limits = MachineLimits(start=0.5 * sum(own["travel"]), units=units, seconds=wishes.budget.seconds, **own)
    return WalkPlan(axis, limits, wishes.budget, wishes.sets, robot=robot)


def absolute(topic: str, namespace: str) -> str:
    """The full name of a topic."""
    return topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"


class Settler(ExcitationClient):
    """``run`` conducts the walk, in a separate thread; others read ``steps``, ``doing``, ``part``, ``ending`` and ``problem``."""

    def __init__(
        self, wishes: Wishes, say: Callable[[str], None], ended: Callable[[], bool], go: Callable[[], bool], namespace: str = NAMESPACE
    ) -> None:
        """say: called with each line for the user; ended: called often, true if the user wants to stop; go: true if experiments may run."""
        super().__init__("settle", ended, namespace)
        self.wishes = wishes
        self.steps: tuple[dict[str, Any], ...] = ()
        self.doing, self.part, self.ending, self.problem = "", 0.0, "", ""
        self._say, self._go, self._namespace = say, go, namespace.rstrip("/")
        self._bag: BagWriter | None = None
        self._units = USUAL
        self._samples: tuple[int, float] = (0, 0.0)  # recorded voltage samples, and their rate, Hz
        self._status: dict[str, str] = {}
        self._message = ""
        self._wall = Wall(lambda words: None)  # reported in a sentence at the end, and in the log
        self._node.create_subscription(DiagnosticArray, "metrics", self._wall.around(self._on_statuses), 100)

    def run(self) -> bool:
        """True if the walk ended without a fault; ``problem`` is a sentence on the fault, ``ending`` the reason of the end."""
        before: ExcitationSettings | None = None
        with self._wall:
            try:
                before = self.settings()
                self._walk(before)
            except XySysidError as problem:
                self.problem = str(problem)
            finally:
                self.doing = ""
                self._rest(before)
        if self._wall.count:
            self._node.get_logger().error(self._wall.told)
            self.problem = BROKEN
        if self.problem or self.ending == "stopped":
            self._say(self.outcome)
        return not self.problem

    @property
    def outcome(self) -> str:
        """The end in a sentence: a fault, the settled set, or the sets that are still possible if it was stopped."""
        if self.problem or not self.steps:
            return self.problem or "Stopped before the first recording was diagnosed."
        last = self.steps[-1]
        return str(last["sentence"]) if last["ending"] else still_open("stopped", last["left"], last["chosen"])

    def _walk(self, settings: ExcitationSettings) -> None:
        wishes, plan = self.wishes, plan_of(self.wishes, settings, self._effort() if settings.holds else None, self._namespace)
        self._units = plan.limits.units
        self._listen(settings)
        wishes.folder.mkdir(parents=True, exist_ok=False)
        decider = Decider(plan_document(plan), wishes.effect_files)
        try:
            self.doing = "starting"
            while not self._over() and decider.news() is None:  # nothing moves while this computer is busy loading it
                self.wait(0.05)
            if self._over():
                return
            bag = self._first(settings)
            while not self.ending:
                news = self._decided(decider, bag)
                if news is None or news.step is None:
                    break
                step = news.step
                self.steps = (*self.steps, step)
                self._say(step["diagnosis"])
                self._say(step["sentence"])
                write_walk(wishes.folder, plan, self.steps)
                if step["ending"]:
                    self.ending = step["ending"]
                    break
                self._say(f"Next: {step['words']}, for {step['lasts']:.0f} s.")
                self.doing = "waiting for Run it"
                while not self._go() and not self._over():
                    self.wait(0.1)
                if self._over():
                    break
                bag = self._carried_out(len(self.steps), step, news.motion, settings)
        finally:
            decider.close()

    # the machine

    def _first(self, settings: ExcitationSettings) -> Path:
        """The bag of a recording of the present excitation, which is then deactivated."""
        self.doing = f"recording {self.wishes.first:.0f} s of the present excitation"
        state = self.state()
        if state != "active" and not self.wishes.alone:
            raise BadInput("excitation", state, "active", "Activate it, so that there is a first recording.")
        with self._recording(0, settings):
            if state == "unconfigured":
                self._change("configure")
            if state != "active" and not self._over():
                self._change("activate")
            self._record(self.wishes.first, settings)
            if not self._over():
                self._change("deactivate")
        return self.wishes.folder / "0"

    def _carried_out(self, number: int, step: dict[str, Any], motion: Trajectory | None, settings: ExcitationSettings) -> Path:
        """The bag of an experiment that the excitation has checked and run; sets ``ending`` to stopped if it was not complete."""
        file, seconds, content = self.wishes.folder / f"next_{number}.yaml", float(step["lasts"]), step["file"]
        if motion is not None:
            write_text(file.with_suffix(".csv"), as_csv(motion))
            content = {"experiment": {**content["experiment"], "motion": file.with_suffix(".csv").name}}
        write_text(file, f"# Experiment {number} of a walk. {step['words']}\n" + yaml.safe_dump(content, sort_keys=False, width=120))
        self.doing = f"running experiment {number}: {step['words']}, {seconds:.0f} s"
        if self.state() == "active":
            self._change("deactivate")
        if self.state() == "inactive":
            self._change("cleanup")
        self.set({"experiment": str(file.resolve())})
        self._change("configure")
        with self._recording(number, settings):
            if not self._over():
                self._change("activate")
                self._record(seconds + settings.ramp, settings)
        count, rate = self._samples
        if rate <= 0.0 or count < WHOLE * seconds * rate:
            self.ending = "stopped"
            self._say(f"Experiment {number} was stopped after {count / rate if rate else 0.0:.1f} s: {self._message}.")
        return self.wishes.folder / str(number)

    def _record(self, seconds: float, settings: ExcitationSettings) -> None:
        """Wait until this many s of voltage have been recorded, no samples come, or the excitation has stopped."""
        heard, newest, driven = 0, time.monotonic(), False
        while time.monotonic() < newest + max(LATE, settings.patience) and not self._over():
            self.wait(0.05)
            if self._samples[0] > heard:
                heard, newest = self._samples[0], time.monotonic()
            driven = driven or self._status.get("state") in ("active", "stopping")
            if self._samples[1] and self._samples[0] >= seconds * self._samples[1]:
                return
            if driven and self._status.get("state") in ("stopped", "idle"):
                self.wait(SETTLES)  # messages in transit
                return

    def _decided(self, decider: Decider, bag: Path) -> DecisionNews | None:
        """The next step, or None if the walk was ended meanwhile. Raises BadInput if the decision fails."""
        if self.ending:
            return None
        self.doing, self.part = "diagnosing all recordings and designing the next experiment", 0.0
        decider.ask(bag)
        while not self._over():
            news = decider.news()
            if news is not None and news.problem:
                raise BadInput("decision", news.problem, "recordings that suffice", "Record again.")
            if news is not None:
                self.part = news.part
                if news.step is not None:
                    return news
            self.wait(0.1)
        return None

    def _over(self) -> bool:
        """True if the user has ended the walk, STOP is on, or an error occurred."""
        if not self.ending and (self._is_over() or self._status.get("stop") == "on"):
            self.ending = "stopped"
        return bool(self.ending or self._wall.count)

    def _change(self, label: str) -> None:
        """A transition; raises BadInput with the excitation's own words if it is refused."""
        try:
            self.transition(label)
        except BadInput:
            self.wait(SETTLES)
            raise BadInput("excitation", f"did not {label}: {self._message or 'no reason given'}", "an excitation that does", "See above.") from None
        self.wait(0.05)

    def _rest(self, before: ExcitationSettings | None) -> None:
        """Deactivate, and restore the settings that experiments change. Other changes, as of limits by an operator, are kept."""
        if before is None:
            return
        try:
            if self.state() == "active":
                self.transition("deactivate")
            now = {item.name: item.value for item in knobs(self.settings())}
            changed = {item.name: item.value for item in knobs(before) if item.value != now.get(item.name) and of_an_experiment(item.name)}
            if changed:
                kind: Any = Parameter
                request = SetParametersAtomically.Request(parameters=[kind(name, value=value).to_parameter_msg() for name, value in changed.items()])
                self.call(SetParametersAtomically, "set_parameters_atomically", request)
        except BadInput as problem:
            self.problem = self.problem or str(problem)

    def _effort(self) -> Effort:
        """The effort as the diagnoser reads it, or the identifier. Raises BadInput if neither does."""
        for name in READERS * ASKED:
            told = self.parameters(name, ("effort_lag", "input_unit", "effort_as_voltage"))
            if told.get("effort_as_voltage"):
                return Effort(int(told["effort_lag"]), str(told["input_unit"]))
        act = "Start one of them with effort_as_voltage, effort_lag and input_unit, as in config/ros2_trajectory.yaml."
        raise BadInput("effort of the joint", "read by neither diagnoser nor identifier", "one that tells its unit and age", act)

    # subscriptions

    def _listen(self, settings: ExcitationSettings) -> None:
        topics: dict[str, Any] = {"voltage": Float64MultiArray}
        if settings.output == "commands":
            topics[settings.joint_topic] = JointState
        else:
            topics["position"] = Float64MultiArray
        for topic, kind in topics.items():
            self._node.create_subscription(kind, topic, self._wall.around(self._writer(topic, kind)), QUALITY, raw=True)

    def _writer(self, topic: str, kind: Any) -> Callable[[bytes], None]:
        name = absolute(topic, self._namespace)
        text = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"

        def write(message: bytes) -> None:
            if self._bag is None:
                return
            self._bag.write_raw(name, text, message, time.time_ns())
            if topic == "voltage":
                block = from_message(deserialize_message(message, kind))
                if len(block) > 1:
                    rate = (block.seq[-1] - block.seq[0]) / (block.time[-1] - block.time[0])
                    self._samples = self._samples[0] + len(block), float(rate)

        return write

    @contextmanager
    def _recording(self, number: int, settings: ExcitationSettings) -> Iterator[None]:
        """Write all received messages to a bag meanwhile, which is complete at the end."""
        units = dict(zip(("input_unit", "output_unit"), self._units, strict=True))
        with BagWriter(self.wishes.folder / str(number), custom=units) as bag:
            self._bag, self._samples = bag, (0, 0.0)
            try:
                yield
            finally:
                self._bag = None

    def _on_statuses(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == NODE:
                self._status = {pair.key: pair.value for pair in status.values}
                self._message = status.message
