"""The state of the topics: which nodes run or are lost, and the history of the resonance. Pure functions; time is an argument."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.messages import read_transfer_function
from xy_sysid.live.plain_messages import ArrayMessage, StatusMessage, topic_of
from xy_sysid.live.status_values import RATE, REFERENCE, SECONDS, WATCHED, number, units_of
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units

LOST = 4.0  # s without a message or an entry in the graph after which a node is called lost
HISTORY = 2000  # resonance estimates kept for each axis
IDLE = "idle"  # the diagnoser's status of an axis without running work
KNOWN = ("excitation", "identifier", "ballscrew", "diagnoser", "recorder")
COUPLING, COUPLED = "coupling", "coupling of "  # prefixes of the topic and of the status about two axes
SPEAKER = {"streams": "identifier"}  # sender of a status whose name differs from the node's
OFTEN = {"excitation", "ballscrew", "identifier"}  # nodes that send a status at least once a second


@dataclass(frozen=True, slots=True)
class Tracked:
    """One resonance estimate: seconds of data, Hz, the reference in Hz, and whether the alarm was on."""

    seconds: float
    frequency: float
    reference: float
    alarm: bool


@dataclass(frozen=True, slots=True)
class NodeState:
    """One node as the page shows it. level: 0 well, 1 of note, 2 wrong, 3 silent or lost."""

    name: str
    level: int
    words: str
    lost: bool


@dataclass
class TopicsState:
    """The newest message of each kind; ``version`` counts the messages of a kind, so that a page knows when to redraw.

    One thread writes and others read: copy a table before iterating over it. own_stop: the name under which this server publishes STOP.
    """

    arrays: dict[str, ArrayMessage] = field(default_factory=dict)
    statuses: dict[str, StatusMessage] = field(default_factory=dict)
    when: dict[str, float] = field(default_factory=dict)
    stories: dict[str, dict[str, Any]] = field(default_factory=dict)
    resonances: dict[str, deque[Tracked]] = field(default_factory=dict)
    present: dict[str, float] = field(default_factory=dict)
    lifecycle: str = ""
    doings: dict[str, tuple[str, float]] = field(default_factory=dict)
    version: dict[str, int] = field(default_factory=dict)
    own_stop: str = ""

    def axes(self) -> tuple[str, ...]:
        """Axes named in any received array, status or story, sorted by name."""
        ends = {self._axis(end) for kind, _, end in (topic.partition("/") for topic in list(self.arrays)) if kind != COUPLING}
        return tuple(sorted(ends | self._named()))

    def coupling(self) -> tuple[str, ArrayMessage | None]:
        """The verdict on two axes that are driven at the same time, and the coupling by band; empty before there is one."""
        said = next((status.message for name, status in list(self.statuses.items()) if name.startswith(COUPLED)), "")
        return said, next((array for topic, array in list(self.arrays.items()) if topic.startswith(f"{COUPLING}/")), None)

    def table(self, kind: str, axis: str) -> ArrayMessage | None:
        """The newest of ``frf``, ``comparison``, ``transfer_function`` or ``error_ladder`` of an axis."""
        return self.arrays.get(topic_of(kind, axis))

    def _named(self) -> set[str]:
        """Axes that a status or a story has named."""
        return {name.removeprefix("axis ") for name in list(self.statuses) if name.startswith("axis ")} | set(self.stories)

    def _axis(self, end: str) -> str:
        """The axis for the last part of a topic name: joint-2 for frf/joint_2, because a topic name cannot contain every axis name."""
        return next((axis for axis in self._named() if topic_of("frf", axis) == f"frf/{end}"), end)

    def array(self, message: ArrayMessage) -> None:
        """Store a message with an array."""
        self.arrays[message.topic] = message
        self._changed(message.topic)
        self._changed(f"axis {self._axis(message.topic.partition('/')[2])}")

    def status(self, status: StatusMessage, now: float) -> None:
        """Store one status of ``metrics`` or ``diagnosis``."""
        self.statuses[status.name] = status
        self.when[SPEAKER.get(status.name, "identifier" if status.name.startswith("axis ") else status.name)] = now
        self._changed(status.name)
        if status.name.startswith("axis "):
            self._track(status.name.removeprefix("axis "), status)

    def story(self, axis: str, text: str) -> str:
        """Store a story document; returns what is wrong with it, or an empty text."""
        try:
            document = json.loads(text)
        except ValueError:
            return f"story/{axis} is not JSON"
        except RecursionError:
            return f"story/{axis} is nested too deeply to be a story"
        if not isinstance(document, dict):
            return f"story/{axis} is not a document"
        axis = str(document.get("axis") or axis)
        self.stories[axis] = document
        self._changed(f"story {axis}")
        return ""

    def doing(self, values: Mapping[str, str], now: float) -> None:
        """Store the diagnoser's current work on each axis; values: of its status ``progress``, as ``axis x``: ``idle``."""
        for key, words in values.items():
            axis = key.removeprefix("axis ")
            words = "" if words == IDLE else words
            if axis != key and words != self.doings.get(axis, ("", 0.0))[0]:
                self.doings[axis] = words, now
                self._changed(f"progress {axis}")

    def graph(self, names: set[str], now: float) -> None:
        """Store the names of the nodes in the namespace."""
        for name in names:
            self.present[name] = now
        self._changed("graph")

    def nodes(self, now: float) -> list[NodeState]:
        """Every node of this system that was ever present, with its latest status."""
        found = []
        for name in [*KNOWN, *sorted(set(self.present) - set(KNOWN))]:
            seen = max(self.present.get(name, -math.inf), self.when.get(name, -math.inf))
            if seen == -math.inf:
                continue
            status = self.statuses.get("streams" if name == "identifier" else name)
            if now - seen > LOST:
                found.append(NodeState(name, 3, f"lost: nothing received for {now - seen:.0f} s", True))
            elif name in OFTEN and name in self.when and now - self.when[name] > LOST:
                found.append(NodeState(name, 3, f"does not answer: silent for {now - self.when[name]:.0f} s", True))
            else:
                level = status.level if status else 0
                if level == 3 and self.lifecycle != "active":
                    level = 0  # no drive is active: silent streams are normal
                found.append(NodeState(name, level, status.message if status else "there", False))
        return found

    def values(self, name: str) -> dict[str, str]:
        """The named values of a status."""
        status = self.statuses.get(name)
        return dict(status.values) if status else {}

    def transfer_function(self, axis: str) -> TransferFunction | None:
        """The newest fit of an axis."""
        message = self.table("transfer_function", axis)
        if message is None or len(message.sizes) != 3 or sum(message.sizes) != message.data.size:
            return None
        return read_transfer_function(message)

    def rate(self, axis: str) -> float:
        """Sampling rate in Hz, 0 while it is not known."""
        return number(self.values(f"axis {axis}"), RATE, 0.0)

    def units(self, name: str) -> Units:
        """Units of input and output from a status: an axis (identifier), or the excitation."""
        return units_of(self.values(name))

    def driving(self) -> bool:
        """True if the excitation reports that it drives."""
        return self.values("excitation").get("state") in ("active", "stopping")

    def stopped_by_others(self) -> str:
        """Nodes that hold STOP, except this page's server (Activate releases its STOP); empty if none."""
        holders = [name for name in self.values("excitation").get("stop held by", "").split(", ") if name]
        return ", ".join(name for name in holders if name != self.own_stop)

    def at_rest_since(self, begun: float) -> bool:
        """True if the excitation has reported after that time that it does not drive."""
        return self.when.get("excitation", -math.inf) > begun and self.values("excitation").get("state") in ("idle", "stopped")

    def alarms(self) -> list[str]:
        """Sentences about axes whose resonance has moved."""
        return [status.message for name, status in sorted(self.statuses.items()) if name.startswith("axis ") and status.level == 2]

    def _track(self, axis: str, status: StatusMessage) -> None:
        values = dict(status.values)
        seconds, now, reference = (number(values, name) for name in (SECONDS, WATCHED, REFERENCE))
        if math.isnan(seconds + now + reference):
            return
        past = self.resonances.setdefault(axis, deque(maxlen=HISTORY))
        if past and seconds < past[-1].seconds:
            past.clear()  # the identifier restarted
        past.append(Tracked(seconds, now, reference, status.level == 2))

    def _changed(self, name: str) -> None:
        self.version[name] = self.version.get(name, 0) + 1


def columns(message: ArrayMessage) -> dict[str, FloatArray]:
    """The columns of a table topic by name; empty if it is not one."""
    if len(message.sizes) != 2 or message.sizes[0] * message.sizes[1] != message.data.size:
        return {}
    names = message.labels[1].split(",")
    table = message.data.reshape(message.sizes)
    return {name: table[:, k] for k, name in enumerate(names)} if len(names) == table.shape[1] else {}


def thinned(frequency: FloatArray, size: FloatArray, most: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Indices of about ``most`` lines at most, for a log axis: each narrow range keeps its smallest and largest value."""
    if frequency.size <= most:
        return np.arange(frequency.size)
    positive = np.maximum(frequency, frequency[frequency > 0].min() if (frequency > 0).any() else 1.0)
    edges = np.geomspace(positive[0], positive[-1] * (1 + 1e-9), most // 2 + 1)
    which = np.clip(np.searchsorted(edges, positive, side="right") - 1, 0, most // 2 - 1)
    kept: list[int] = []
    bounds = np.flatnonzero(np.diff(which)) + 1
    for part in np.split(np.arange(frequency.size), bounds):
        kept += sorted({int(part[np.argmin(size[part])]), int(part[np.argmax(size[part])])})
    return np.array(kept, dtype=np.intp)
