"""Identifier node: receives voltage and position; publishes frequency response, transfer function, comparison and metrics.

A thin adapter: the logic is ``identifier.Identifier`` on the data path and ``fitter.LiveFitter`` in a separate thread, so
data never wait for a fit.
"""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any

from std_msgs.msg import Float64MultiArray
from std_srvs.srv import Trigger

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.files.state import load_state, save_state, set_aside
from xy_sysid.live import status_values
from xy_sysid.live.coupling_messages import coupling_topics
from xy_sysid.live.fitter import LiveFitter, Update, warm_up
from xy_sysid.live.heard import verdict
from xy_sysid.live.identifier import Identifier
from xy_sysid.live.plain_messages import WARN, StatusMessage, topic_of
from xy_sysid.nodes.axes import AXES, declare_axes
from xy_sysid.nodes.common import LATCHED_QOS, WalledNode, declare
from xy_sysid.nodes.convert import array_to_ros, status_to_ros
from xy_sysid.nodes.diagnostics import Diagnostics
from xy_sysid.nodes.since_commissioning import SinceCommissioning
from xy_sysid.nodes.streams import HEARING, Streams, answered
from xy_sysid.processes.fit_thread import FitWorker
from xy_sysid.samples.block import Block, StreamName
from xy_sysid.settings import IdentifierSettings

PUBLISH_PERIOD = 0.05  # s between two checks for finished fits
HEARTBEAT = 1.0  # s between two statuses of the streams
# A change of one of these restarts the spectra; names and types of topics are fixed when the node starts.
SHAPES_SPECTRA = ("window", "length", "overlap", "differenced", "memory", "sliding", "alarm_windows", "reorder")
FIXED = ("response", *HEARING, "state_file", "save_every", "baseline", "baseline_table")


class IdentifierNode(WalledNode):
    """The adapter: topics, services, parameters and the state file around the pure logic."""

    def __init__(self) -> None:
        super().__init__("identifier")
        axes = declare_axes(self)
        self._ready = False
        self._own = declare(self, IdentifierSettings(), self._accept, also=[AXES], fixed=FIXED)
        settings = self._own.settings
        self._axes = axes
        self._identifier = Identifier(settings, self._axes, settings.units)
        self._since = SinceCommissioning.of_identifier(settings, axes)
        self._worker = FitWorker(self._fitter(settings))
        self._state_path = Path(settings.state_file).expanduser() if settings.state_file else None
        self._metrics = Diagnostics(self)
        self._arrays: dict[str, Any] = {}
        for axis in self._axes:
            for kind in ("frf", "transfer_function", "comparison"):
                self._publisher(topic_of(kind, axis))
        for topic in coupling_topics(self._axes):
            self._publisher(topic)
        self._resume()
        warm_up(settings)  # before the subscriptions: compilation would block the data path
        self._streams = Streams(self, self._axes, settings, self._feed)
        for name, act in (("reset", self._reset), ("save", self._save), ("load", self._load)):
            self.create_service(Trigger, f"~/{name}", functools.partial(answered, act))
        self.create_timer(PUBLISH_PERIOD, self._publish_done)
        self.create_timer(HEARTBEAT, self._beat)
        if self._state_path is not None:
            self.create_timer(settings.save_every, self._save_quietly)
        self._ready = True

    # data

    def _feed(self, kind: StreamName, block: Block) -> None:
        for request in self._identifier.feed(kind, block):
            self._worker.ask(request)

    # results

    def _publisher(self, topic: str) -> Any:
        if topic not in self._arrays:
            latched = topic.startswith("transfer_function/")
            self._arrays[topic] = self.create_publisher(Float64MultiArray, topic, LATCHED_QOS if latched else 10)
        return self._arrays[topic]

    def _publish_done(self) -> None:
        for update in self._worker.done():
            self._publish(update)

    def _publish(self, update: Update) -> None:
        for message in update.arrays():
            self._publisher(message.topic).publish(array_to_ros(message))
        self._metrics.publish(status_to_ros(item, "identifier") for item in update.statuses())
        for axis, part in update.axes.items():
            if part.stretch is not None:
                self._since.hear(axis, part.stretch.fit.intervals_with_misfit, part.stretch.begin, part.stretch.end)
        self._metrics.publish(status_to_ros(item, "identifier") for item in self._since.statuses())

    def _beat(self) -> None:
        """Publish the status of the streams, once a second, also without a fit."""
        recent, now = self._streams.recent, time.monotonic()
        heard = self._streams.heard(self._identifier.samples, self._identifier.sentences, self._identifier.faults)
        level, text = verdict(heard, f"{', '.join(heard.streams[:-1])} and {heard.streams[-1]} are received")
        if recent.goes_on("callbacks", self.wall.count, now):
            level, text = max(level, WARN), f"{text}; {self.wall.told}"
        if recent.goes_on("skipped fits", self._worker.skipped, now):
            level, text = max(level, WARN), f"{text}; {self._worker.skipped} fits were skipped, the machine is too slow for this rate"
        values = {
            "samples paired": str(self._identifier.samples),
            status_values.RATE: f"{self._identifier.sampling_rate or 0.0:.9g}",
            "messages refused": str(self._streams.refusals),
            "errors of callbacks": str(self.wall.count),
            "skipped fits": str(self._worker.skipped),
        }
        values |= {f"newest {kind}": str(seq) for kind, seq in self._identifier.waiting.items()}
        values |= {f"windows {axis}": str(number) for axis, number in self._identifier.windows.items()}
        values |= {f"stream: {reason}": str(number) for reason, number in self._identifier.faults.items()}
        status = StatusMessage("streams", level, text, tuple(values.items()))
        self._metrics.publish([status_to_ros(status, "identifier")])

    # parameters and services

    def _accept(self, settings: IdentifierSettings) -> None:
        if not self._ready:
            return
        before = self._own.settings
        if any(getattr(before, name) != getattr(settings, name) for name in SHAPES_SPECTRA):
            self._identifier = Identifier(settings, self._axes, settings.units)
            self._worker.change(self._fitter(settings))
            self.get_logger().info("the spectra are restarted with the new settings")
        else:
            self._identifier.change(settings)
            references = self._worker.fitter.references()
            fitter = self._fitter(settings)
            fitter.restore(references)
            self._worker.change(fitter)

    def _fitter(self, settings: IdentifierSettings) -> LiveFitter:
        """A new fitter without data; the comparison with the baseline restarts too."""
        self._since.forget()
        return LiveFitter(settings, self._since.models)

    def _reset(self) -> str:
        self._identifier.reset()
        self._streams.forget()
        self._worker.change(self._fitter(self._own.settings))
        return "all received data were deleted"

    def _save(self) -> str:
        path = self._path()
        save_state(path, self._identifier.state() | self._worker.fitter.state())
        return f"saved {sum(self._identifier.windows.values())} windows to {path}"

    def _load(self) -> str:
        path = self._path()
        state = load_state(path)
        self._identifier.restore(state)
        fitter = self._fitter(self._own.settings)
        fitter.recall(state)
        self._worker.change(fitter)
        return f"loaded {sum(self._identifier.windows.values())} windows from {path}"

    def _path(self) -> Path:
        if self._state_path is None:
            raise BadInput("parameter state_file", "empty", "the name of a file", "Start the node with it.")
        return self._state_path

    def _resume(self) -> None:
        """Continue with the saved spectra, if there are any that match."""
        if self._state_path is None or not self._state_path.exists():
            return
        try:
            self.get_logger().info(self._load())
        except XySysidError as problem:
            kept = set_aside(self._state_path)
            self.get_logger().error(f"{problem} The file is kept as {kept}; the spectra are restarted.")

    def _save_quietly(self) -> None:
        try:
            self._save()
        except (OSError, XySysidError) as problem:
            self.get_logger().error(f"the state could not be saved: {problem}", throttle_duration_sec=60.0)

    def last_words(self) -> None:
        """Publish the last fits, and save."""
        for update in self._worker.close():
            self._publish(update)
        if self._state_path is not None:
            self._save_quietly()
