"""The page's own ROS 2 node, in a thread of its own: it hears results and stories and passes orders on."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger

from xy_sysid.messages import StatusMessage
from xy_sysid.nodes.common import LATCHED_QOS, NAMESPACE
from xy_sysid.nodes.convert import array_from_ros
from xy_sysid.page.heard import Heard

WATCHERS = ("page", "demo")  # nodes that only look on
LOOK = 0.5  # s between two looks at the graph and the lifecycle
PATIENCE = 5.0  # s for an answer of a node
TABLES = ("frf", "transfer_function", "comparison")
STOP_AGAIN = 1.0  # s after which STOP is sent again while nobody has confirmed it
STOP_GIVES_UP = 6.0  # s
AT_REST = ("inactive", "unconfigured", "finalized")

Told = Callable[[bool, str], None]  # whether an order was done, and the node's sentence


class Link:
    """Everything between the page and the nodes. Orders return at once; ``told`` is called later, in the link's thread."""

    def __init__(self, heard: Heard, namespace: str = NAMESPACE) -> None:
        self.heard = heard
        self._orders: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._ended = threading.Event()
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node: Any = rclpy.create_node("page", namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._clients: dict[str, Any] = {}
        self._topics: set[str] = set()
        self._waiting: list[tuple[float, Any, str, Told]] = []
        self._node.create_subscription(DiagnosticArray, "metrics", self._on_statuses, 100)
        self._node.create_subscription(DiagnosticArray, "diagnosis", self._on_diagnosis, LATCHED_QOS)
        self._node.create_timer(LOOK, self._look)
        self._thread = threading.Thread(target=self._spin, name="page link", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Leave the graph."""
        self._ended.set()
        self._thread.join(3.0)
        self._node.destroy_node()
        self._context.try_shutdown()

    # orders, from any thread

    def transition(self, label: str, told: Told) -> None:
        """configure, activate, deactivate or cleanup the excitation."""
        request = ChangeState.Request(transition=Transition(label=label))
        self._orders.put(lambda: self._call(ChangeState, "excitation/change_state", request, told, lambda a: (a.success, "")))

    def stop(self, told: Told) -> None:
        """Deactivate the excitation and see that it is inactive; asked again until it is, told as failed if it never is."""
        begun = time.monotonic()
        self._orders.put(lambda: self._stop(begun, told))

    def trigger(self, service: str, told: Told, patience: float = PATIENCE) -> None:
        """A service without arguments, such as identifier/reset; patience: s that it may take."""
        self._orders.put(lambda: self._call(Trigger, service, Trigger.Request(), told, lambda a: (a.success, a.message), patience))

    def set_parameters(self, node: str, values: dict[str, Any], told: Told) -> None:
        """Change parameters of a node; all or the sentence of the first that was refused."""

        def order() -> None:
            kind: Any = Parameter
            request = SetParameters.Request(parameters=[kind(name, value=value).to_parameter_msg() for name, value in values.items()])
            self._call(SetParameters, f"{node}/set_parameters", request, told, _all_set)

        self._orders.put(order)

    def get_parameters(self, node: str, names: list[str], give: Callable[[dict[str, Any]], None], told: Told) -> None:
        """The values of parameters as the node has them now."""

        def read(answer: Any) -> tuple[bool, str]:
            give({name: parameter_value_to_python(value) for name, value in zip(names, answer.values, strict=False)})
            return True, ""

        self._orders.put(lambda: self._call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=names), told, read))

    # in the link's thread

    def _spin(self) -> None:
        while not self._ended.is_set():
            self._executor.spin_once(timeout_sec=0.05)
            while not self._orders.empty():
                self._orders.get()()
            now = time.monotonic()
            for entry in [entry for entry in self._waiting if entry[0] < now]:
                self._waiting.remove(entry)
                entry[1].cancel()
                entry[3](False, f"{entry[2].partition('/')[0]} did not answer in time")

    def _client(self, kind: Any, service: str) -> Any:
        if service not in self._clients:
            self._clients[service] = self._node.create_client(kind, service)
        return self._clients[service]

    def _call(
        self,
        kind: Any,
        service: str,
        request: Any,
        told: Told,
        read: Callable[[Any], tuple[bool, str]],
        patience: float = PATIENCE,
        since: float = 0.0,
    ) -> None:
        """Call a service, once it is there; told the answer, or that there is none."""
        client, since = self._client(kind, service), since or time.monotonic()
        if not client.service_is_ready():
            if time.monotonic() - since > 2.0:
                told(False, f"{service.partition('/')[0]} is not there")
            else:
                _later(0.1, lambda: self._orders.put(lambda: self._call(kind, service, request, told, read, patience, since)))
            return
        future = client.call_async(request)
        entry = (time.monotonic() + patience, future, service, told)
        self._waiting.append(entry)

        def done(answered: Any) -> None:
            if entry in self._waiting:
                self._waiting.remove(entry)
                told(*read(answered.result()))

        future.add_done_callback(done)

    def _stop(self, begun: float, told: Told) -> None:
        """Send it, look at the state, and again until it is seen to be inactive."""
        if time.monotonic() - begun > STOP_GIVES_UP:
            told(False, "STOP was not confirmed by the excitation: use the emergency stop of the machine")
            return
        change, states = self._client(ChangeState, "excitation/change_state"), self._client(GetState, "excitation/get_state")
        answered = threading.Event()

        def look(future: Any) -> None:
            self.heard.lifecycle = label = future.result().current_state.label
            if label in AT_REST and not answered.is_set():
                answered.set()
                told(True, f"stopped: the excitation is {label}, the voltage is zero")

        def again() -> None:
            if not answered.is_set():
                self._orders.put(lambda: self._stop(begun, told))

        if change.service_is_ready() and states.service_is_ready():
            request = ChangeState.Request(transition=Transition(label="deactivate"))
            change.call_async(request).add_done_callback(lambda _: states.call_async(GetState.Request()).add_done_callback(look))
        _later(STOP_AGAIN, again)

    def _look(self) -> None:
        """Who is there, which axes they publish, and how the excitation is."""
        space = self._node.get_namespace()
        names = {
            name for name, where in self._node.get_node_names_and_namespaces() if where == space and name not in WATCHERS and not name.startswith("_")
        }
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
        client.call_async(GetState.Request()).add_done_callback(lambda future: setattr(self.heard, "lifecycle", future.result().current_state.label))

    def _listen(self, kind: str, axis: str) -> None:
        topic = f"{kind}/{axis}"
        if kind == "story":
            self._node.create_subscription(String, topic, lambda message: self._on_story(axis, message), LATCHED_QOS)
            return
        quality: Any = LATCHED_QOS if kind == "transfer_function" else 10
        self._node.create_subscription(Float64MultiArray, topic, lambda message: self.heard.array(array_from_ros(topic, message)), quality)

    def _on_story(self, axis: str, message: String) -> None:
        problem = self.heard.story(axis, message.data)
        if problem:
            self._node.get_logger().warning(problem)

    def _on_diagnosis(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == "progress":
                self.heard.doing(status.message, time.monotonic())

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
