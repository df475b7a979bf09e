"""Diagnoser node: receives voltage and position; on request it finds the missing effect, and the error after each added effect.

A thin adapter: ``diagnoser.Diagnoser`` decides, ``story_process`` calculates in a separate process.
"""

from __future__ import annotations

import functools
import json
import time
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.parameter import Parameter
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger

from xy_sysid.errors import BadInput
from xy_sysid.files.effects import library
from xy_sysid.live import status_values
from xy_sysid.live.diagnoser import Diagnoser
from xy_sysid.live.diagnosis_messages import diagnosis_status, ladder_message
from xy_sysid.live.heard import verdict
from xy_sysid.live.plain_messages import OK, STALE, WARN, StatusMessage, topic_of
from xy_sysid.nodes.axes import AXES, declare_axes
from xy_sysid.nodes.common import LATCHED_QOS, WalledNode, declare
from xy_sysid.nodes.convert import array_to_ros, status_to_ros, statuses_to_ros
from xy_sysid.nodes.diagnostics import Diagnostics
from xy_sysid.nodes.later import LaterTrigger
from xy_sysid.nodes.since_commissioning import SinceCommissioning
from xy_sysid.nodes.streams import HEARING, Streams, answered
from xy_sysid.processes.story_process import StoryWorker
from xy_sysid.settings import DiagnoserSettings, given
from xy_sysid.story.acts import Act
from xy_sysid.story.document import document
from xy_sysid.story.story import Story, allowed

LOOK = 0.1  # s between two checks of the worker
HEARTBEAT = 1.0  # s between two statuses in metrics
ACTS: tuple[Act, ...] = ("begin", "diagnose", "renew", "add_next", "auto")  # services, for all axes and for each
IDLE = "idle"
FIXED = (*HEARING, "effect_files", "baseline", "baseline_table")


class DiagnoserNode(WalledNode):
    """The adapter: topics, services and parameters around the pure logic and its worker."""

    def __init__(self) -> None:
        super().__init__("diagnoser")
        self._axes = declare_axes(self)
        self._ready = False
        defaults = DiagnoserSettings(effects={axis: [""] for axis in self._axes})
        self._own = declare(self, defaults, self._accept, also=[AXES], fixed=FIXED)
        settings = self._own.settings
        files = given(settings.effect_files)
        self._library = library([Path(file).expanduser() for file in files])
        self._check(settings)
        self._since = SinceCommissioning.of_diagnoser(settings, self._axes, self._library)
        self._diagnoser = Diagnoser(settings, self._axes)
        self._worker = StoryWorker(files)
        self._told: tuple[str, ...] = ()
        self._metrics = Diagnostics(self)
        self._diagnosis = self.create_publisher(DiagnosticArray, "diagnosis", LATCHED_QOS)
        self._ladders = {axis: self.create_publisher(Float64MultiArray, topic_of("error_ladder", axis), LATCHED_QOS) for axis in self._axes}
        self._stories = {axis: self.create_publisher(String, topic_of("story", axis), LATCHED_QOS) for axis in self._axes}
        self._triggers: list[LaterTrigger] = []
        self._serve(self._axes)
        for axis in self._axes:
            self._serve((axis,), axis)
        self.create_service(Trigger, "~/forget", functools.partial(answered, self._forget))
        self._streams = Streams(self, self._axes, settings, self._diagnoser.feed)
        self.create_timer(LOOK, self._look)
        self.create_timer(HEARTBEAT, self._beat)
        self._ready = True
        self._tell()

    def _serve(self, axes: tuple[str, ...], of: str = "") -> None:
        """Create the services for all axes, or for one: ~/diagnose and ~/diagnose/x."""
        for act in ACTS:
            name = topic_of(act, of) if of else act
            self._triggers.append(LaterTrigger(self, f"~/{name}", functools.partial(self._diagnoser.ask, act, axes)))
        for kind, do in (("reset_model", self._reset_model), ("cancel", self._cancel)):
            name = topic_of(kind, of) if of else kind
            self.create_service(Trigger, f"~/{name}", functools.partial(answered, functools.partial(do, axes)))

    # work

    def _look(self) -> None:
        """Give the worker its next job, and publish its reports."""
        for item in self._worker.news():
            if item.ended:
                self._compare(self._diagnoser.under_way)
                self._diagnoser.finish(item.problem)
                if item.problem:
                    self.get_logger().error(item.problem)
                self._follow()
            else:
                self._diagnoser.progress(item.doing, item.story)
                if item.story is not None:
                    self._show(item.story, item.text)
            self._tell()
        job = self._diagnoser.start()
        if job is not None:
            self._worker.ask(job)
        answers = self._diagnoser.answers()
        for answer in answers:
            for service in self._triggers:
                service.answer(answer.request, answer.done, answer.text)
            self.get_logger().info(answer.text)
        if answers or job is not None:
            self._tell()

    def _compare(self, axis: str) -> None:
        """Compare the newest model of an axis with the one of commissioning."""
        story, used = self._diagnoser.stories.get(axis), self._diagnoser.used(axis)
        if story is not None and story.now is not None and used is not None:
            self._since.hear(axis, story.now.parameters, *used)

    def _show(self, story: Story, text: str) -> None:
        self._ladders[story.axis].publish(array_to_ros(ladder_message(story)))
        self._stories[story.axis].publish(String(data=text))

    def _tell(self) -> None:
        """Publish ``diagnosis``: every axis, and the current activity."""
        diagnoser = self._diagnoser
        statuses = [
            diagnosis_status(diagnoser.stories[axis])
            if axis in diagnoser.stories
            else StatusMessage(f"axis {axis}", STALE, f"axis {axis}: not diagnosed yet; call the service diagnose", ())
            for axis in self._axes
        ]
        doing = diagnoser.doing or ("waiting" if diagnoser.busy else IDLE)
        own = diagnoser.doings()
        values = tuple((f"axis {axis}", own.get(axis, IDLE)) for axis in self._axes)
        statuses.append(StatusMessage("progress", OK, doing, (("progress", doing), *values)))
        self._diagnosis.publish(statuses_to_ros(statuses, self.get_clock().now().to_msg(), "diagnoser"))

    def _beat(self) -> None:
        """Publish the status of the streams, once a second."""
        hearing = self._diagnoser.hearing
        level, text = verdict(self._streams.heard(hearing.total, hearing.sentences, hearing.faults), "voltage and position are received")
        text = f"{text}; {hearing.seconds:.1f} s without a gap are kept"
        if self._streams.recent.goes_on("callbacks", self.wall.count, time.monotonic()):
            level, text = max(level, WARN), f"{text}; {self.wall.told}"
        values = {
            status_values.KEPT: f"{hearing.seconds:.6g}",
            "samples paired": str(hearing.total),
            status_values.RATE: f"{hearing.sampling_rate or 0.0:.9g}",
            "messages refused": str(self._streams.refusals),
            "errors of callbacks": str(self.wall.count),
            "progress": self._diagnoser.doing or IDLE,
            status_values.HEARD: f"{hearing.total / hearing.sampling_rate if hearing.sampling_rate else 0.0:.6g}",
        }
        for axis in self._axes:
            used = self._diagnoser.used(axis)
            values |= {name: f"{at:.6g}" for name, at in zip(status_values.used(axis), used, strict=True)} if used is not None else {}
        values |= {f"stream: {reason}": str(number) for reason, number in hearing.faults.items()}
        status = StatusMessage("diagnoser", level, text, tuple(values.items()))
        self._metrics.publish(status_to_ros(item, "diagnoser") for item in (status, *self._since.statuses()))

    # parameters and services

    def _check(self, settings: DiagnoserSettings) -> None:
        """Raises BadInput for an unknown axis or effect."""
        for axis in settings.effects:
            if axis not in self._axes:
                raise BadInput("effects of axis", repr(axis), ", ".join(self._axes), "Choose one of these.")
            for name in settings.chosen(axis):
                allowed(name, self._library)

    def _accept(self, settings: DiagnoserSettings) -> None:
        if not self._ready:
            return
        before = self._own.settings
        self._check(settings)
        self._diagnoser.change(settings)
        for axis in self._axes:
            if settings.chosen(axis) not in (before.chosen(axis), self._diagnoser.effects[axis]):
                self._diagnoser.have(axis, settings.chosen(axis))

    def _follow(self) -> None:
        """Set the parameters effects.<axis> to the effects in the models."""
        wrong = {axis: names for axis, names in self._diagnoser.effects.items() if names != self._own.settings.chosen(axis)}
        if wrong:
            make: Any = Parameter
            self.set_parameters([make(f"effects.{axis}", value=list(names) or [""]) for axis, names in wrong.items()])

    def _reset_model(self, axes: tuple[str, ...]) -> str:
        self._diagnoser.reset_model(axes)
        self._follow()
        for story in [story for axis, story in self._diagnoser.stories.items() if axis in axes]:
            self._show(story, json.dumps(document(story), allow_nan=False, separators=(",", ":")))
        self._tell()
        return "the models are rigid again"

    def _forget(self) -> str:
        self._diagnoser.reset()
        self._streams.forget()
        self._since.forget()
        return "all received data were deleted"

    def _cancel(self, axes: tuple[str, ...]) -> str:
        if self._diagnoser.under_way in axes:
            self._worker.cancel()
        text = self._diagnoser.cancel(axes)
        self._follow()
        self._tell()
        return text

    def last_words(self) -> None:
        """Answer all waiting requests."""
        for service in self._triggers:
            service.give_up("the diagnoser ends")
        self._worker.close()
