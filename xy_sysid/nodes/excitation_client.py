"""Client of the excitation's parameters and transitions; raises BadInput without an answer, or with the reason of a refusal."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from xy_sysid.errors import BadInput
from xy_sysid.nodes.own_context import OwnContext
from xy_sysid.settings import ExcitationSettings, build, knobs

ANSWER = 10.0  # s to wait for an answer of the excitation while its node is present
ASKED = 3  # attempts
APPEARS = 60.0  # s to wait for the excitation node
SOON = 1.0  # s instead, if the user wants to stop, since a running excitation must still receive the request; and for a node that may be absent
NODE = "excitation"


class ExcitationClient(OwnContext):
    """A separate node, in the thread that calls it. ended: called often; true if the user wants to stop."""

    def __init__(self, name: str, ended: Callable[[], bool], namespace: str) -> None:
        super().__init__(name, namespace)
        self._is_over = ended

    def wait(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            self._executor.spin_once(timeout_sec=0.01)

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """The answer. A request is repeated if none arrives, because answers are lost during discovery, except for a change of state.

        Raises BadInput without an answer.
        """
        for _ in range(1 if kind is ChangeState else ASKED):
            answer = self._ask(kind, service, request)
            if answer is not None or self._is_over():
                break
        if answer is None:
            raise BadInput("excitation", f"no answer to {service}", "a running node excitation in the run file", "See its messages above.")
        return answer

    def _ask(self, kind: Any, service: str, request: Any) -> Any:
        """The answer, or None after the timeout."""
        client = self._node.create_client(kind, f"{NODE}/{service}")
        asked = time.monotonic()
        while not client.service_is_ready() and time.monotonic() < asked + (SOON if self._is_over() else APPEARS):
            self.wait(0.05)
        future = client.call_async(request)
        until = time.monotonic() + ANSWER
        while not future.done() and time.monotonic() < until and client.service_is_ready():
            self._executor.spin_once(timeout_sec=0.01)
        answer = future.result() if future.done() else None
        self._node.destroy_client(client)
        return answer

    def settings(self) -> ExcitationSettings:
        names = list(self.call(ListParameters, "list_parameters", ListParameters.Request()).result.names)
        values = self.call(GetParameters, "get_parameters", GetParameters.Request(names=names)).values
        given = {name: parameter_value_to_python(value) for name, value in zip(names, values, strict=True)}
        axes = given["axes"]
        known = {item.name for item in knobs(ExcitationSettings())} | {name for name in given if name.partition(".")[0] in axes}
        return build(ExcitationSettings, {name: value for name, value in given.items() if name in known}, "excitation")

    def set(self, values: dict[str, Any]) -> None:
        kind: Any = Parameter
        request = SetParameters.Request(parameters=[kind(name, value=value).to_parameter_msg() for name, value in values.items()])
        refused = [result.reason for result in self.call(SetParameters, "set_parameters", request).results if not result.successful]
        if refused:
            raise BadInput("excitation", f"refused: {refused[0]}", "settings that it accepts", "Change the run file.")

    def parameters(self, node: str, names: Sequence[str]) -> dict[str, Any]:
        """Parameters of another node in the namespace; empty if it is not there."""
        client = self._node.create_client(GetParameters, f"{node}/get_parameters")
        until = time.monotonic() + SOON
        future = None
        while time.monotonic() < until and (future is None or not future.done()):
            if future is None and client.service_is_ready():
                future, until = client.call_async(GetParameters.Request(names=list(names))), time.monotonic() + ANSWER
            self._executor.spin_once(timeout_sec=0.01)
        answer = future.result() if future is not None and future.done() else None
        self._node.destroy_client(client)
        return {} if answer is None else {name: parameter_value_to_python(value) for name, value in zip(names, answer.values, strict=False)}

    def state(self) -> str:
        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def transition(self, label: str) -> None:
        if not self.call(ChangeState, "change_state", ChangeState.Request(transition=Transition(label=label))).success:
            raise BadInput("excitation", f"did not {label}", "an excitation that does", "See its messages above.")
