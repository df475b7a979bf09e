"""The page's own ROS 2 node: it receives results and stories and sends orders. It is restarted if it fails.

The node runs in its own thread (``_Line``). ``Link`` supervises it and survives its failure. STOP has its own publisher and is
published from the caller's thread; every order, also the service calls of STOP, goes to the node that is then alive.
"""

from __future__ import annotations

import math
import os
import queue
import re
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from std_msgs.msg import Bool, Float64MultiArray, String
from std_srvs.srv import Trigger

from xy_sysid.live.plain_messages import StatusMessage
from xy_sysid.nodes.common import LATCHED_QOS, NAMESPACE, STOP_TOPIC
from xy_sysid.nodes.convert import array_from_ros
from xy_sysid.nodes.own_context import OwnContext
from xy_sysid.nodes.wall import Wall
from xy_sysid.page.topics_state import COUPLING, TopicsState

WATCHERS = ("page", "demo", "settle")  # nodes of the page and of commands; they start and stop often
STOPS = "page_stop"  # name prefix of the nodes with which pages publish STOP
LOOK = 0.5  # s between two polls of the graph and the lifecycle
PATIENCE = 5.0  # s for an answer of a node
AGAIN = 2  # retries of a parameter request without an answer
TABLES = ("frf", "transfer_function", "comparison", COUPLING)
STOP_AGAIN = 0.5  # s after which STOP is sent again if it is not confirmed
STOP_LOOK = 0.05  # s between two checks that the excitation has confirmed STOP
STOP_GIVES_UP = 6.0  # s
AT_REST = ("inactive", "unconfigured", "finalized")
WATCH = 0.2  # s between two checks that the link's thread is alive
STUCK = 3.0  # s without an iteration of its loop after which the thread counts as dead

Told = Callable[[bool, str], None]  # receives whether an order succeeded, and the node's sentence


@dataclass(frozen=True, slots=True)
class _Question:
    """A service call: its type, name and request, and a function that reads the answer: success, and the node's sentence.

    again: retries if no answer arrives, because a loaded computer loses some; only for calls that may safely run twice
    """

    kind: Any
    service: str
    request: Any
    read: Callable[[Any], tuple[bool, str]]
    again: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """A pending call: its timeout in s, its deadline, and the future of its answer."""

    question: _Question
    told: Told
    patience: float
    until: float
    future: Any

    @property
    def node(self) -> str:
        """The name of the called node."""
        return self.question.service.partition("/")[0]


class Link:
    """The connection between the page and the nodes. Orders return at once; ``told`` is called later, in the link's thread."""

    def __init__(self, heard: TopicsState, namespace: str = NAMESPACE, say: Callable[[str], None] = lambda words: None) -> None:
        """say: receives messages for users about the link itself."""
        self.heard = heard
        self.problem = ""  # why nothing is received; empty while the link works
        self._namespace, self._say = namespace, say
        self._orders: queue.SimpleQueue[Callable[[_Line], None]] = queue.SimpleQueue()
        self._ended = threading.Event()
        self._wire = _StopWire(namespace)
        heard.own_stop = self._wire.name
        self._line = _Line(heard, namespace, self._orders, say)
        self._watch = threading.Thread(target=self._look_after, name="page link watch", daemon=True)
        self._watch.start()

    def close(self) -> None:
        """Remove the node from the graph."""
        self._ended.set()
        self._watch.join(3.0)
        self._line.close()
        self._wire.close()

    # orders, from any thread

    def transition(self, label: str, told: Told) -> None:
        """configure, activate, deactivate or clean up the excitation; activate also releases the STOP of this page."""
        if label == "activate":
            self._wire.put(False)
        request = ChangeState.Request(transition=Transition(label=label))

        def ask(then: Told) -> None:
            self._orders.put(lambda line: line.call(_Question(ChangeState, "excitation/change_state", request, lambda a: (a.success, "")), then))

        def once_more(done: bool, words: str) -> None:  # the release may arrive after the request
            told(done, words) if done or words or label != "activate" else _later(STOP_AGAIN, lambda: ask(told))

        ask(once_more)

    def stop(self, told: Told) -> None:
        """Command zero volts by topic and by service; ``told`` reports the excitation's confirmation, or that there was none."""
        stop = _Stop(time.monotonic(), told)
        self._wire.put(True)
        self._orders.put(lambda line: line.stop(stop))

    def trigger(self, service: str, told: Told, patience: float = PATIENCE) -> None:
        """Call a service without arguments, such as identifier/reset; patience: timeout in s."""
        question = _Question(Trigger, service, Trigger.Request(), lambda a: (a.success, a.message))
        self._orders.put(lambda line: line.call(question, told, patience))

    def set_parameters(self, node: str, values: dict[str, Any], told: Told) -> None:
        """Change parameters of a node; ``told`` reports success, or the reason for the first refused one."""

        def order(line: _Line) -> None:
            kind: Any = Parameter
            request = SetParameters.Request(parameters=[kind(name, value=value).to_parameter_msg() for name, value in values.items()])
            line.call(_Question(kind=SetParameters, service=f"{node}/set_parameters", request=request, read=_all_set, again=AGAIN), told)

        self._orders.put(order)

    def get_parameters(self, node: str, names: list[str], give: Callable[[dict[str, Any]], None]) -> None:
        """Read the node's current parameter values; ``give`` receives them, if the node answers."""

        def read(answer: Any) -> tuple[bool, str]:
            give({name: parameter_value_to_python(value) for name, value in zip(names, answer.values, strict=False)})
            return True, ""

        request = GetParameters.Request(names=names)
        question = _Question(kind=GetParameters, service=f"{node}/get_parameters", request=request, read=read, again=AGAIN)
        self._orders.put(lambda line: line.call(question, lambda done, words: None))

    # the watch

    def _look_after(self) -> None:
        wall = Wall(self._say)
        while not self._ended.wait(WATCH):
            why = self._line.dead()
            if why:
                with wall:
                    self._begin_anew(why)

    def _begin_anew(self, why: str) -> None:
        if not self.problem:
            self.problem = f"the link to the nodes was lost ({why}) and is restarted"
            self._say(self.problem)
        self._line.abandon()
        self._line = _Line(self.heard, self._namespace, self._orders, self._say)
        self.problem = ""
        self._say("the link to the nodes is restored")


class _StopWire(OwnContext):
    """The publisher of STOP: a node that needs no thread and is independent of the link, which may fail.

    name: unique to this server, so that it never takes another page's STOP for its own.
    """

    def __init__(self, namespace: str) -> None:
        self.name = f"{STOPS}_{re.sub('[^A-Za-z0-9]', '_', socket.gethostname())}_{os.getpid()}"
        super().__init__(self.name, namespace)
        self._topic = self._node.create_publisher(Bool, STOP_TOPIC, LATCHED_QOS)

    def put(self, on: bool) -> None:
        """Publish STOP, or its release; latched."""
        self._topic.publish(Bool(data=on))


@dataclass
class _Stop:
    """A STOP in progress. begun, asked: s, time of the request and of the latest service call."""

    begun: float
    told: Told
    asked: float = -math.inf
    over: bool = False

    def confirm(self, state: str) -> None:
        """Report that the excitation is at rest."""
        if not self.over:
            self.over = True
            self.told(True, f"stopped: the excitation is {state}, the voltage is zero")


class _Line(OwnContext):
    """One node in one thread; if it dies, ``Link`` replaces it."""

    def __init__(self, heard: TopicsState, namespace: str, orders: queue.SimpleQueue[Callable[[_Line], None]], say: Callable[[str], None]) -> None:
        super().__init__("page", namespace)
        self.heard = heard
        self.wall = Wall(say)
        self.beat = time.monotonic()
        self._orders, self._ended = orders, threading.Event()
        self._clients: dict[str, Any] = {}
        self._topics: set[str] = set()
        self._waiting: list[_Asked] = []
        around = self.wall.around
        self._node.create_subscription(DiagnosticArray, "metrics", around(self._on_statuses), 100)
        self._node.create_subscription(DiagnosticArray, "diagnosis", around(self._on_diagnosis), LATCHED_QOS)
        self._node.create_timer(LOOK, around(self._look))
        self._thread = threading.Thread(target=self._spin, name="page link", daemon=True)
        self._thread.start()

    def dead(self) -> str:
        """Why the node has stopped working; empty while it works."""
        if not self._thread.is_alive():
            return self.wall.told or "its thread has ended"
        silent = time.monotonic() - self.beat
        return f"it has not responded for {silent:.0f} s" if silent > STUCK else ""

    def close(self) -> None:
        """Remove the node from the graph."""
        self._ended.set()
        self._thread.join(3.0)

    def abandon(self) -> None:
        """Give up this node, and inform callers that wait for an answer."""
        self._ended.set()
        for asked in self._waiting:
            if not self._once_more(asked):
                asked.told(False, f"{asked.node} could not be asked: the link to the nodes was lost")
        self._waiting.clear()

    def call(self, question: _Question, told: Told, patience: float = PATIENCE, since: float = 0.0) -> None:
        """Call a service as soon as it is available; ``told`` receives the answer, or that there is none."""
        client, since = self._client(question.kind, question.service), since or time.monotonic()
        if not client.service_is_ready():
            if time.monotonic() - since > 2.0:
                told(False, f"{question.service.partition('/')[0]} is not there")
            else:
                _later(0.1, lambda: self._orders.put(lambda line: line.call(question, told, patience, since)))
            return
        future = client.call_async(question.request)
        asked = _Asked(question=question, told=told, patience=patience, until=time.monotonic() + patience, future=future)
        self._waiting.append(asked)

        def done(answered: Any) -> None:
            if asked in self._waiting:
                self._waiting.remove(asked)
                told(*question.read(answered.result()))

        future.add_done_callback(self.wall.around(done))

    def stop(self, stop: _Stop) -> None:
        """Request deactivation and check the state; repeat until the excitation is at rest, for STOP_GIVES_UP at most."""
        now = time.monotonic()
        if self.heard.at_rest_since(stop.begun):  # its status counts if its services do not answer
            stop.confirm("at rest")
        if stop.over:
            return
        if now - stop.begun > STOP_GIVES_UP:
            stop.over = True
            stop.told(False, "STOP was not confirmed by the excitation: use the emergency stop of the machine")
            return
        _later(STOP_LOOK, lambda: self._orders.put(lambda line: line.stop(stop)))

        def look(future: Any) -> None:
            self.heard.lifecycle = label = future.result().current_state.label
            if label in AT_REST:
                stop.confirm(label)

        change, states = self._client(ChangeState, "excitation/change_state"), self._client(GetState, "excitation/get_state")
        if now - stop.asked > STOP_AGAIN and change.service_is_ready() and states.service_is_ready():
            stop.asked = now
            request = ChangeState.Request(transition=Transition(label="deactivate"))
            seen = self.wall.around(look)
            ask = self.wall.around(lambda _: states.call_async(GetState.Request()).add_done_callback(seen))
            change.call_async(request).add_done_callback(ask)

    # in its thread

    def _spin(self) -> None:
        """Run until closed; in any case remove the node from the graph in the thread that used it."""
        try:
            while not self._ended.is_set() and self._context.ok():
                self._turn()
        finally:
            super().close()

    def _turn(self) -> None:
        self.beat = time.monotonic()
        with self.wall:
            self._executor.spin_once(timeout_sec=0.05)
        while not self._orders.empty() and not self._ended.is_set():
            with self.wall:
                self._orders.get()(self)
        now = time.monotonic()
        for asked in [asked for asked in self._waiting if asked.until < now]:
            self._waiting.remove(asked)
            asked.future.cancel()
            if not self._once_more(asked):
                asked.told(False, f"{asked.node} did not answer in time")

    def _once_more(self, asked: _Asked) -> bool:
        """Repeat the call if that is safe, with the node that is then alive."""
        question = replace(asked.question, again=asked.question.again - 1)
        if question.again < 0:
            return False
        self._orders.put(lambda line: line.call(question, asked.told, asked.patience))
        return True

    def _client(self, kind: Any, service: str) -> Any:
        if service not in self._clients:
            self._clients[service] = self._node.create_client(kind, service)
        return self._clients[service]

    def _look(self) -> None:
        """Update the list of nodes, their axes, and the state of the excitation."""
        space = self._node.get_namespace()
        found = self._node.get_node_names_and_namespaces()
        names = {name for name, where in found if where == space and name not in WATCHERS and not name.startswith(("_", STOPS))}
        self.heard.graph(names, time.monotonic())
        for topic, _ in self._node.get_topic_names_and_types():
            kind, _, axis = topic.removeprefix(f"{space}/").partition("/")
            if topic.startswith(f"{space}/") and axis and topic not in self._topics and kind in (*TABLES, "story"):
                self._topics.add(topic)
                self._listen(kind, axis)
        client = self._client(GetState, "excitation/get_state")
        if "excitation" not in names or not client.service_is_ready():
            self.heard.lifecycle = ""
            return

        def seen(future: Any) -> None:
            self.heard.lifecycle = future.result().current_state.label

        client.call_async(GetState.Request()).add_done_callback(self.wall.around(seen))

    def _listen(self, kind: str, axis: str) -> None:
        topic = f"{kind}/{axis}"
        around = self.wall.around
        if kind == "story":
            self._node.create_subscription(String, topic, around(lambda message: self._on_story(axis, message)), LATCHED_QOS)
            return
        quality: Any = LATCHED_QOS if kind == "transfer_function" else 10
        self._node.create_subscription(Float64MultiArray, topic, around(lambda message: self.heard.array(array_from_ros(topic, message))), quality)

    def _on_story(self, axis: str, message: String) -> None:
        problem = self.heard.story(axis, message.data)
        if problem:
            self._node.get_logger().warning(problem)

    def _on_diagnosis(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == "progress":
                self.heard.doing({pair.key: pair.value for pair in status.values}, time.monotonic())

    def _on_statuses(self, message: DiagnosticArray) -> None:
        for status in message.status:
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            values = tuple((pair.key, pair.value) for pair in status.values)
            self.heard.status(StatusMessage(status.name, level, status.message, values), time.monotonic())


def _later(seconds: float, act: Callable[[], None]) -> None:
    timer = threading.Timer(seconds, act)
    timer.daemon = True
    timer.start()


def _all_set(answer: Any) -> tuple[bool, str]:
    refused = [result.reason for result in answer.results if not result.successful]
    return not refused, refused[0] if refused else ""
